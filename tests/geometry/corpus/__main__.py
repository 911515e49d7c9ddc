"""``python -m tests.geometry.corpus FOLDER`` writes files and answers; ``--page`` the page."""

import json
import sys
from pathlib import Path

from tests.geometry.corpus import corpus_cases, folders
from tests.geometry.corpus.case import Case, write
from tests.geometry.corpus.folder_cases import write_folder
from tests.geometry.corpus.page import PAGE, page


def answer(case: Case) -> dict[str, object]:
    """What is right for a case, for a reader that is not ours."""
    if case.solid is None:
        return {"what": case.what, "refused": case.refused}
    return {
        "what": case.what,
        "volume_m3": case.solid.volume_m3,
        "area_m2": case.solid.area_m2,
        "nsvr": case.solid.nsvr,
        "bodies": case.bodies,
        "tolerance": case.tolerance,
        "recorded": case.recorded,
    }


def main(where: str) -> None:
    """All files and what is right for them, or the page of the corpus."""
    if where == "--page":
        PAGE.write_text(page())
        return
    folder = Path(where)
    answers: dict[str, dict[str, object]] = {}
    for case in corpus_cases():
        write(case, folder)
        answers[case.name] = answer(case)
    for folder_case in folders():
        write_folder(folder_case, folder)
        objects = {name: vars(known) for name, known in folder_case.objects.items()}
        answers[folder_case.name] = {"what": folder_case.what, "objects": objects}
    (folder / "answers.json").write_text(json.dumps(answers, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
