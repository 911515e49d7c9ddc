"""Mesh formats, a reader each: the bytes of a file in, a surface in the file's own unit out.

No library read all of the corpus under tests/geometry/corpus right, and each took files in
silence that hold no mesh or another one (the page of runs has the table): what a format leaves
open is decided here, and a refusal gives the reason that is true.
"""
