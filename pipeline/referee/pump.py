"""The fan's curve, and its working point against a leak."""

from dataclasses import dataclass

from scipy.optimize import brentq


@dataclass(frozen=True)
class Fan:
    """Δp = Δp_0 (1 - (Q / Q_0)^m).

    Attributes
    ----------
    vacuum_pa
        Δp_0, where no air flows [Pa].
    flow_m3_s
        Q_0, where there is no resistance [m3/s].
    exponent
        m [1].
    """

    vacuum_pa: float
    flow_m3_s: float
    exponent: float

    def vacuum_at(self, flow_m3_s: float) -> float:
        """Δp of a flow between 0 and Q_0 [Pa]."""
        return float(self.vacuum_pa * (1.0 - (flow_m3_s / self.flow_m3_s) ** self.exponent))


def working_point(fan: Fan, conductance_m3_s_pa: float) -> float:
    """Δp at which the fan draws what a leak Q = G Δp lets in.

    Parameters
    ----------
    fan
        Its curve.
    conductance_m3_s_pa
        G ≥ 0 [m3/s/Pa].

    Returns
    -------
    Δp in (0, Δp_0] [Pa].
    """
    highest = min(fan.vacuum_pa, fan.flow_m3_s / max(conductance_m3_s_pa, 1e-300))

    def excess(vacuum_pa: float) -> float:
        return fan.vacuum_at(conductance_m3_s_pa * vacuum_pa) - vacuum_pa

    if excess(highest) >= 0.0:
        return highest
    return float(brentq(excess, 0.0, highest, xtol=1e-9 * fan.vacuum_pa))
