"""The motion that carries a lifted object aside and back."""


def there_and_back(leg: float) -> float:
    """Share of a way at a time in legs, each of full acceleration and then full braking.

    leg : 0 at the start, 1 at the far end, from 2 on back at the start.
    """
    left = min(abs(leg - 1.0), 1.0)
    return 1.0 - 2.0 * left**2 if left < 0.5 else 2.0 * (1.0 - left) ** 2
