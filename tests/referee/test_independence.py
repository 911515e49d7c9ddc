"""The referee can contradict the label, for it knows nothing of it."""

import grimp


def test_the_referee_knows_nothing_of_the_label() -> None:
    graph = grimp.build_graph("pipeline")
    reached = graph.find_upstream_modules("pipeline.referee", as_package=True)
    assert not {name for name in reached if name.startswith("pipeline.gripper")}
    assert not {name for name in reached if name.startswith("pipeline.labelling")}
