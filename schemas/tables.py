"""Tables that `make query` makes of a run's artifacts: every column, its unit and meaning.

``python -m schemas.tables`` writes TABLES.md, the page of it. What a file does not tell is NULL.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).parent / "TABLES.md"
TEXT = "text"


@dataclass(frozen=True)
class Column:
    """One column of a table.

    Attributes
    ----------
    name
        Its name in SQL.
    kind
        ``text``, or NumPy's type string without byte order.
    meaning
        What it holds, with unit and frame.
    """

    name: str
    kind: str
    meaning: str


@dataclass(frozen=True)
class Table:
    """One table.

    Attributes
    ----------
    name
        Its name in SQL.
    stage
        The stage whose artifact holds it; empty: every artifact holds some of it.
    meaning
        What one row is.
    columns
        Its columns, in order.
    """

    name: str
    stage: str
    meaning: str
    columns: tuple[Column, ...]


SCENE = Column("scene", TEXT, "id of the scene")
LEVEL = Column("level", "u1", "level of Table II, 1 to 9")
CLASS = Column("shape_class", TEXT, "basic, typical or complex, by NSVR")
SPLIT = Column("split", TEXT, "train, val or test")
BODY = Column("body_id", "u2", "number of the object within its scene, from 1")
KEY = Column("key", TEXT, "digest of what the item rests on; NULL in files of softgrip.v1")
POSE = (
    *(Column(f"{axis}_m", "f8", f"{axis} of its place in the world [m]") for axis in "xyz"),
    *(Column(f"q{part}", "f8", f"{part} of its turn, a unit quaternion") for part in "wxyz"),
)
Q = Column("q", "f8", "label of S-1.12, in [0, 1]")
P = Column("p", "f8", "pressure of Eq. (2), in [0, 1]")

OF_STAGES = (
    Table(
        "objects",
        "objects",
        "an object of the catalogue",
        (
            Column("object", TEXT, "name"),
            SPLIT,
            CLASS,
            Column("family", TEXT, "objects of one family are alike, and all in one split"),
            Column("source", TEXT, "mesh file, or parametric"),
            Column("source_sha256", TEXT, "digest of the mesh file"),
            Column("unit", TEXT, "length unit of the source"),
            Column("unit_origin", TEXT, "how the unit is known: declared, detected, configured"),
            Column("repairs", TEXT, "what was done to close the surface, in order, by commas"),
            Column("scale", "f8", "size over that of the source [1]"),
            Column("extent_m", "f8", "longest extent [m]"),
            Column("area_m2", "f8", "of the outer surface [m2]"),
            Column("volume_m3", "f8", "of the solid [m3]"),
            Column("nsvr", "f8", "Eq. (15) [1]"),
            Column("mass_kg", "f8", "mass [kg]"),
            Column("material", TEXT, "opaque or transparent"),
            Column("faces", "u4", "triangles of the surface"),
            Column("convex_parts", "u2", "shapes that physics sees"),
            Column("copies", "u2", "further files of the same surface, left out"),
            KEY,
        ),
    ),
    Table(
        "refused",
        "objects",
        "a mesh that did not become an object",
        (
            Column("source", TEXT, "mesh file"),
            Column("reason", TEXT, "why, in words"),
            Column("remedy", TEXT, "what a person can do"),
        ),
    ),
    Table(
        "scenes",
        "scenes",
        "a clutter at rest",
        (
            SCENE,
            LEVEL,
            CLASS,
            Column("distribution", TEXT, "isolated, multiple or stacked"),
            SPLIT,
            Column("seed", "u8", "what it was drawn from"),
            Column("objects", "u2", "objects in it"),
            Column("contacts", "u2", "pairs of objects that touch"),
            Column("settle_time_s", "f8", "simulated time until all rested [s]"),
            Column("renderer", TEXT, "what made its pictures"),
            Column("viewpoints", "u2", "cameras"),
            KEY,
        ),
    ),
    Table(
        "placed_objects",
        "scenes",
        "an object where it lies in a scene",
        (
            SCENE,
            Column("object", TEXT, "name in the catalogue"),
            BODY,
            *POSE,
            Column("gap_m", "f8", "surface to surface, to the nearest other object [m]"),
        ),
    ),
    Table(
        "grasps",
        "grasps",
        "a labelled grasp",
        (
            SCENE,
            Column("grasp", "u4", "number within the scene, from 0"),
            Column("viewpoint", TEXT, "camera that saw the contact"),
            LEVEL,
            CLASS,
            SPLIT,
            Column("object", TEXT, "name of what is grasped"),
            BODY,
            *POSE,
            Q,
            P,
            *(Column(f"f_{axis}", "f8", f"{axis} of GW, over A^G [1]") for axis in "xyz"),
            Column("tau_z", "f8", "moment of GW about z, over A^G r_G [1]"),
            Column("least_slack", "f8", "least slack of Eq. (8)-(11) [1]"),
            Column("tightest_limit", TEXT, "the limit that has it"),
            Column("w_least", "f8", "least weight w_j"),
            Column("w_greatest", "f8", "greatest weight w_j"),
            Column("w_deviation", "f8", "root mean square deviation of w_j from 1"),
            Column("contact_share", "f4", "share of the pad's vertices in contact [1]"),
            Column("status", TEXT, "how the QP ended"),
            Column("iterations", "u1", "of the QP"),
            Column("tilt_rad", "f4", "approach off the surface normal [rad]"),
            Column("proposal", TEXT, "rule that proposed it"),
            Column("keep_probability", "f4", "chance that balancing kept it"),
            Column("touch_height_m", "f8", "first touch above the contact, along z [m]"),
            Column("pictures", "u1", "pictures that its cloud was cut from"),
        ),
    ),
    Table(
        "samples",
        "shards",
        "a training sample",
        (
            SPLIT,
            Column("sample", "u8", "number within its split, from 0"),
            Column("object", TEXT, "name of what is grasped"),
            CLASS,
            LEVEL,
            Q,
            P,
            Column("proposal_weight", "f4", "first proposals that it stands for"),
            Column("pictures", "u1", "pictures that its cloud was cut from"),
        ),
    ),
    Table(
        "epochs",
        "train",
        "an epoch of training",
        (
            Column("epoch", "u4", "number"),
            Column("train_loss", "f8", "what was minimised"),
            Column("train_mae", "f8", "mean |q-hat - q| on train"),
            Column("val_mae", "f8", "mean |q-hat - q| on val"),
            Column("learning_rate", "f8", "at its end"),
            Column("samples", "u8", "seen in it"),
        ),
    ),
    Table(
        "attempts",
        "evaluate",
        "an attempt of a policy in a clutter",
        (
            SCENE,
            LEVEL,
            Column("policy", TEXT, "closed-loop, or a baseline's name"),
            Column("attempt", "u4", "number within scene and policy"),
            Column("outcome", TEXT, "lifted or failed"),
            Column("cause", TEXT, "why it failed; NULL when lifted"),
            Column("object", TEXT, "what was under the pad; NULL if nothing"),
            Column("candidates", "u4", "poses that were ranked"),
            Column("predicted_q", "f8", "q-hat of the pose chosen"),
            Column("reached_q", "f8", "q of the true geometry at the pose reached"),
            Column("seal_pressure", "f8", "of the judge, in [0, 1]"),
            Column("lifted_height_m", "f8", "[m]"),
            Column("duration_s", "f8", "simulated [s]"),
            Column("corrections", "u4", "looks on the way down that were followed"),
            Column("regrasps", "u4", "contacts taken anew after a first tug"),
            Column("seals", "u4", "how often the vacuum was switched on"),
            Column("carried_m_s2", "f8", "largest acceleration borne in transport [m/s2]"),
            Column("borne_n", "f8", "largest weight that the last seal bears [N]"),
            Column("weight_n", "f8", "of the object [N]"),
            Column("judge", TEXT, "referee, label or robot"),
        ),
    ),
)
# Of the provenance that every artifact carries.
INPUTS = Table(
    "inputs",
    "",
    "a file that a stage read",
    (
        Column("stage", TEXT, "the stage"),
        Column("input", TEXT, "the file: an artifact of the run, meshes/..., or another name"),
        Column("sha256", TEXT, "of the file as the stage read it"),
        Column("present_sha256", TEXT, "of the artifact that lies there now; NULL of other files"),
        Column("schema_version", TEXT, "that the stage's artifact was written with"),
        Column("package_version", TEXT, "of the softgrip that wrote it"),
    ),
)
TABLES = (*OF_STAGES, INPUTS)
BY_NAME = {table.name: table for table in TABLES}

# Questions of a working day; the tests ask them of a small run.
QUESTIONS = (
    (
        "Which objects can be gripped, and which cannot?",
        "SELECT object, shape_class, count(*) AS grasps, avg(q) AS mean_q, max(q) AS best_q "
        "FROM grasps GROUP BY ALL ORDER BY mean_q DESC",
    ),
    (
        "Which grasps of complex objects fail, the worst first?",
        "SELECT scene, grasp, object, q, p, status FROM grasps "
        "WHERE shape_class = 'complex' AND q < 0.1 ORDER BY q, scene, grasp LIMIT 100",
    ),
    (
        "How did the QP end, level by level?",
        "SELECT level, status, count(*) AS grasps FROM grasps GROUP BY ALL ORDER BY level, status",
    ),
    (
        "Which limit is the tightest where the pad seals and q is low all the same?",
        "SELECT tightest_limit, count(*) AS grasps, avg(q) AS mean_q FROM grasps "
        "WHERE p > 0.5 AND q < 0.5 GROUP BY ALL ORDER BY grasps DESC",
    ),
    (
        "Are labels spread alike in train, val and test?",
        "SELECT least(floor(10 * q), 9) AS tenth, count(*) FILTER (split = 'train') AS train, "
        "count(*) FILTER (split = 'val') AS val, count(*) FILTER (split = 'test') AS test "
        "FROM samples GROUP BY tenth ORDER BY tenth",
    ),
    (
        "Do objects with near neighbours hold worse?",
        "SELECT placed_objects.gap_m < 0.01 AS near, count(*) AS grasps, avg(q) AS mean_q "
        "FROM grasps JOIN placed_objects USING (scene, body_id) GROUP BY near ORDER BY near",
    ),
    (
        "Which clutters have the fewest good grasps?",
        "SELECT scene, scenes.objects, count(*) FILTER (q > 0.8) AS good, count(*) AS grasps "
        "FROM grasps JOIN scenes USING (scene) GROUP BY ALL ORDER BY good, scene LIMIT 10",
    ),
    (
        "Which objects of the catalogue were never grasped?",
        "SELECT object, split, nsvr, mass_kg FROM objects "
        "WHERE object NOT IN (SELECT object FROM grasps) ORDER BY object",
    ),
    (
        "Which epochs were the best, and does training still learn?",
        "SELECT epoch, val_mae, train_mae, val_mae - train_mae AS gap FROM epochs "
        "ORDER BY val_mae LIMIT 3",
    ),
    (
        "Why do attempts fail, and what had the network promised?",
        "SELECT policy, cause, count(*) AS attempts, avg(predicted_q) AS promised, "
        "avg(reached_q) AS reached FROM attempts WHERE outcome = 'failed' "
        "GROUP BY ALL ORDER BY attempts DESC, policy, cause",
    ),
)


def page() -> str:
    """The page of all tables, as Markdown."""
    lines = [
        "# Tables of a run",
        "",
        'What `make query RUN=<run> SQL="..."` can be asked. Written from `schemas/tables.py` by',
        "`python -m schemas.tables`. What a file does not tell is NULL.",
        "",
    ]
    for table in TABLES:
        source = f"stage {table.stage}" if table.stage else "the provenance of every artifact"
        told = f"A row is {table.meaning}; from {source}."
        lines += [f"## {table.name}", "", told, ""]
        lines += ["| column | type | meaning |", "|-|-|-|"]
        lines += [f"| `{c.name}` | {c.kind} | {c.meaning} |" for c in table.columns]
        lines.append("")
    lines += ["## Questions of a working day", ""]
    for words, sql in QUESTIONS:
        lines += [words, "", "```sql", sql, "```", ""]
    return "\n".join(lines).replace("|q-hat - q|", "\\|q-hat - q\\|")


if __name__ == "__main__":
    PAGE.write_text(page())
    sys.stdout.write(f"{PAGE} is written\n")
