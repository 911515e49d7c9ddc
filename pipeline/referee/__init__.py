"""What a soft pad bears on a true surface, by elasticity, leak, fan and Coulomb's law.

The label asks how much of the pad's region touches (Eq. (2)) and how even the pull is. The referee
knows neither: it presses a cushion under a skin on the surface (`foundation`), lets air in
through the gap that is left (`leak`) against a fan's curve (`pump`), and asks for the largest load
that contact pressure and friction still balance (`load`). So it can contradict the label.
"""
