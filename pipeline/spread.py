"""Choose some of many things at equal distances in their order."""


def choose_evenly(total: int, wanted: int) -> list[int]:
    """Choose at most ``wanted`` of ``total`` indices, at equal distances from first to last.

    Parameters
    ----------
    total
        Number of things.
    wanted
        Greatest number to choose.

    Returns
    -------
    The chosen indices, increasing.
    """
    if total <= wanted:
        return list(range(total))
    return sorted({round(i * (total - 1) / max(wanted - 1, 1)) for i in range(wanted)})
