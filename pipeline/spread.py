"""Some of many things, evenly spread over all of them."""


def choose_evenly(total: int, wanted: int) -> list[int]:
    """Indices of at most ``wanted`` items, evenly spread over ``total``."""
    if total <= wanted:
        return list(range(total))
    return sorted({round(i * (total - 1) / max(wanted - 1, 1)) for i in range(wanted)})
