"""`make board`: a board to print, and the residue of hand-eye calibration by pictures of it."""

import io
import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from loguru import logger
from PIL import Image

from pipeline.artifacts import publish_bytes
from pipeline.errors import CalibrationError
from pipeline.execution import run_command
from pipeline.robot.board import (
    BoardSize,
    HandEyeCheck,
    camera_from_board,
    check_hand_eye,
    draw_board,
    read_grey,
)
from pipeline.robot.calibration import read_calibration

DOTS_AN_INCH = 300  # of common printers
WARNED_MM = 3.0  # more than this, a pad of 25 mm misses what it aims at; ask for less than 2


def board(
    out: Annotated[Path, typer.Argument(help="folder for board.png, or for board.json")],
    poses: Annotated[
        Path | None,
        typer.Option(help='JSON: [{"picture": "0.png", "base_from_flange": [[...]]}, ...]'),
    ] = None,
    calibration: Annotated[Path | None, typer.Option(help="JSON of the cell")] = None,
    columns: Annotated[int, typer.Option(min=3, help="squares of a row")] = 8,
    rows: Annotated[int, typer.Option(min=3, help="squares of a column")] = 6,
    square_mm: Annotated[float, typer.Option(min=1, help="side of a square, as measured")] = 30.0,
) -> None:
    """Draw the board; or, with poses, check a calibration by pictures of it."""
    size = BoardSize(columns, rows, square_mm / 1000)
    if poses is None:
        publish_bytes(out / "board.png", printed(draw_board(size, DOTS_AN_INCH)))
        logger.info("board: print {} at {} dots an inch", out / "board.png", DOTS_AN_INCH)
        return
    if calibration is None:
        raise CalibrationError(f"{poses} is given without a calibration", "Name it: --calibration")
    held = read_calibration(calibration)
    listed = listed_poses(poses)
    boards = [camera_from_board(read_grey(path), held.wrist, size, str(path)) for path, _ in listed]
    found = check_hand_eye([pose for _, pose in listed], boards, held.flange_from_camera, size)
    names = [path.name for path, _ in listed]
    publish_bytes(out / "board.json", (json.dumps(told(found, names), indent=1) + "\n").encode())
    given_mm = float(np.sqrt((found.distance_mm**2).mean()))
    fitted_mm = float(np.sqrt((found.fitted_mm**2).mean()))
    logger.info(
        "board: {} pictures differ by {:.2f} mm, by {:.2f} mm with the hand-eye that fits them "
        "best, which is {:.2f} mm and {:.2f} degrees away: {}",
        len(names),
        given_mm,
        fitted_mm,
        found.off_mm,
        np.degrees(found.off_rad),
        out / "board.json",
    )
    if given_mm > WARNED_MM:
        logger.warning(
            "board: more than {} mm: take flange_from_camera of board.json, and where that fits no "
            "better, check square_mm, intrinsics, and that poses are the flange's",
            WARNED_MM,
        )


def printed(picture: np.ndarray) -> bytes:
    """A PNG that says at how many dots an inch it is to be printed."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, format="PNG", dpi=(DOTS_AN_INCH, DOTS_AN_INCH))
    return file.getvalue()


def told(found: HandEyeCheck, names: list[str]) -> dict[str, Any]:
    """What becomes JSON."""
    return {
        "residue_mm": dict(zip(names, found.distance_mm.round(3).tolist(), strict=True)),
        "residue_of_the_fitted_mm": dict(
            zip(names, found.fitted_mm.round(3).tolist(), strict=True)
        ),
        "given_is_off_by_mm": round(found.off_mm, 3),
        "given_is_off_by_deg": round(float(np.degrees(found.off_rad)), 3),
        "flange_from_camera": found.fitted.round(6).tolist(),
    }


def listed_poses(path: Path) -> list[tuple[Path, np.ndarray]]:
    """Each picture and the arm's pose at it. Raises CalibrationError where the file is no list."""
    try:
        content = json.loads(path.read_text())
        return [
            (
                path.parent / one["picture"],
                np.array(one["base_from_flange"], dtype=np.float64).reshape(4, 4),
            )
            for one in content
        ]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CalibrationError(
            f"{path} is no list of pictures and poses: {error}",
            'Give [{"picture": "0.png", "base_from_flange": 4 rows of 4}, ...]',
        ) from error


if __name__ == "__main__":
    run_command(board)
