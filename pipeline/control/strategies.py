"""The policies that are compared: which ranking, which pictures, and whether the wrench is used."""

from pipeline.config import RunConfig
from pipeline.config.evaluation import PolicyName
from pipeline.control.decision import Strategy
from pipeline.control.ranking import GeometricRanking, NetworkRanking, Predict


def build_strategy(name: PolicyName, predict: Predict, config: RunConfig) -> Strategy:
    """Build one of the policies that are compared.

    - closed-loop: takes several views, corrects its aim on the way, and reacts to the wrench.
    - network: the same, but the network alone rates grasps, whatever `policy.analytic_share` says.
    - analytic: the same with the analytic label on the measured cloud in place of the network.
    - uncorrected: closed-loop without corrections.
    - one-seal: the same as closed-loop without a second seal.
    - open-loop: executes what the network rates best on the first picture.
    - geometric: executes the flattest place for the pad at the highest point, of as many views as
      the closed loop has.

    Each but one-seal may seal as often in an attempt.

    Parameters
    ----------
    name
        Name of the policy.
    predict
        Rates grasps; the geometric policy does not use it.
    config
        The run.

    Returns
    -------
    The policy.
    """
    network = NetworkRanking(
        predict,
        config.sensing,
        config.gripper.pad.radius_m,
        config.evaluate.policy,
    )
    if name == "geometric":
        picker = GeometricRanking(config.evaluate.policy.picker, config.sensing, config.gripper.pad)
        return Strategy(
            name, picker, several_views=True, corrects=False, seals_again=True, feels=False
        )
    loop = name != "open-loop"
    return Strategy(
        name,
        network,
        several_views=loop,
        corrects=loop and name != "uncorrected",
        seals_again=name != "one-seal",
        feels=loop,
    )
