"""[objects] and [split]: from meshes to the object catalogue."""

from typing import ClassVar, Literal, Self, get_args

from pydantic import Field, model_validator

from pipeline.config.section import LengthInMetres, ScaledSection, Section

FEWEST_OBJECTS = 3  # one each for train, val and test
FirstKind = Literal["compact", "lump", "revolved", "extruded", "joined", "hollow", "studded", "rod"]
SolidKind = Literal[FirstKind, "dish", "grooved", "row", "ringed", "tiled", "winged", "drilled"]
# Drawn where run.toml names no kinds: those that there were first.
FIRST_KINDS: tuple[SolidKind, ...] = get_args(FirstKind)


class ConvexPartsConfig(Section):
    """Convex decomposition (CoACD) for collision shapes."""

    concavity: float = Field(0.08, ge=0.01, le=1.0, description="CoACD concavity threshold [1]")
    max_parts: int = Field(16, ge=1, le=256, description="most convex parts an object may have")
    search_iterations: int = Field(20, ge=10, le=500, description="CoACD tree-search iterations")
    search_nodes: int = Field(10, ge=2, le=50, description="CoACD tree-search nodes a level")
    preprocess_resolution: int = Field(
        30, ge=20, le=100, description="CoACD remeshing grid, where it must remesh"
    )
    resolution: int = Field(500, ge=200, le=10000, description="CoACD sampling resolution")
    input_faces: int = Field(
        2000, ge=100, le=200_000, description="faces the mesh is decimated to before decomposition"
    )
    # Scans of single things keep 10 000 at most. A lattice of 10 000 takes CoACD 70 s, and the time
    # grows faster than the faces.
    max_cut_faces: int = Field(
        12_000,
        ge=100,
        le=1_000_000,
        description="meshes that keep more faces after decimation are refused: cutting has no end",
    )


class ObjectsConfig(ScaledSection):
    """Mesh intake: units, repair bounds, rescaling, physical properties."""

    target_extent_min_m: ClassVar[LengthInMetres] = LengthInMetres()
    target_extent_max_m: ClassVar[LengthInMetres] = LengthInMetres()

    limit: int = Field(0, ge=0, description="most objects taken, spread over classes; 0 = all")
    embedded_in_training: bool = Field(
        False, description="with MESH_DIR: train on the embedded objects too, test on meshes alone"
    )
    copies: Literal["one", "all"] = Field(
        "one", description="files of one surface: one object, or all objects of one family"
    )
    # Measured on 47 scans: simplified to a quarter of their faces and turned, all but five noisy or
    # thin ones stay under it; the most alike of different ones (screwdrivers) are 0.0041 apart.
    copies_rms: float = Field(
        2e-3, ge=0, le=0.1, description="surfaces nearer than this are one, rms over sqrt(A) [1]"
    )
    random_solids: int = Field(
        0, ge=0, le=9999, description="further shapes for training: solids drawn from the seed"
    )
    first_solid: int = Field(
        1, ge=1, le=999_999, description="number of the first of them; another run has those before"
    )
    solid_kinds: tuple[SolidKind, ...] = Field(
        FIRST_KINDS, min_length=1, description="what kinds of bodies the solids are drawn from"
    )
    grained_share: float = Field(
        0.0,
        ge=0,
        le=1,
        description="share of the solids whose skin has a relief of tenths of a millimetre, as "
        "scans have [1]",
    )
    stretched_copies: int = Field(
        0, ge=0, le=100, description="further shapes made of each training object by stretching it"
    )
    stretch_max: float = Field(
        1.5, ge=1, le=4, description="most that a copy is stretched along one axis over another [1]"
    )
    unit: Literal["auto", "m", "cm", "mm", "in"] = Field(
        "auto", description="length unit of mesh files that declare none; auto = by all their sizes"
    )
    min_extent_m: float = Field(0.002, gt=0, description="smaller meshes are refused [m]")
    max_extent_m: float = Field(5.0, gt=0, description="larger meshes are refused [m]")
    max_file_mib: int = Field(512, ge=1, description="larger mesh files are refused unread [MiB]")
    max_faces: int = Field(2_000_000, ge=4, description="meshes with more faces are refused")
    max_seconds: float = Field(
        900.0,
        ge=1,
        description="safety net: a mesh on which work takes longer is left out for now [s]",
    )
    max_memory_mib: int = Field(
        4096,
        ge=64,
        description="safety net: a mesh on which work takes more is left out for now [MiB]",
    )
    max_hole_fraction: float = Field(
        0.02, ge=0, le=1, description="largest area share of the surface that repair may invent [1]"
    )
    rescaled: bool = Field(
        True, description="false keeps every object's own size, as with a URDF's scale"
    )
    target_extent_min_rg: float = Field(
        2.4, gt=0, description="smallest longest-extent after rescaling [r_G]; Supplement III"
    )
    target_extent_max_rg: float = Field(
        6.4, gt=0, description="largest longest-extent after rescaling [r_G]; Supplement III"
    )
    # Twice the pad's contact tolerance, 0.8 % of its radius: the two sides of a thinner sheet are
    # one to the pad, and convex parts that flat are at the limit of what PhysX can cook.
    min_thickness_m: float = Field(
        2e-4, ge=0, description="objects whose 2 V / A stays under this are refused [m]"
    )
    density_kg_m3: float = Field(
        300.0, gt=0, description="of the closed mesh, where an object's mass is not known [kg/m3]"
    )
    density_spread: float = Field(
        2.0,
        ge=1,
        le=20,
        description="each such object's density lies within this factor of that, drawn [1]",
    )
    masses: str = Field(
        "", description="file beside run.toml of masses by object; else the mesh folder's"
    )
    transparent: tuple[str, ...] = Field(
        (), description="names (with * and ?) of objects that depth cameras see through; VIII"
    )
    convex: ConvexPartsConfig = ConvexPartsConfig()

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if 0 < self.limit < FEWEST_OBJECTS:
            raise ValueError(f"limit must be 0 or at least {FEWEST_OBJECTS}: one object a split")
        if self.min_extent_m > self.max_extent_m:
            raise ValueError("min_extent_m must not exceed max_extent_m")
        if self.target_extent_min_rg > self.target_extent_max_rg:
            raise ValueError("target_extent_min_rg must not exceed target_extent_max_rg")
        return self


class SplitConfig(Section):
    """Split by family of objects: no family is ever in two of train, val, test."""

    families: str = Field(
        "", description="file beside run.toml that declares families; else the mesh folder's"
    )
    all_in_test: bool = Field(
        False, description="every object is of the test split: nothing is trained; make holdout"
    )
    meshes_in_training: bool = Field(
        True,
        description="False: meshes are for val and test, training has the random solids alone",
    )
    # Measured on 47 scans and 65 embedded shapes: from 0.035 to 0.040 the families are the same
    # (balls; cubes; cans; lemon and peach; screwdrivers; ...), at 0.05 balls and cubes are one.
    family_threshold: float = Field(
        0.038,
        ge=0,
        le=1,
        description="shapes less unlike than this are one family [1]",
    )
    val_fraction: float = Field(0.15, gt=0, lt=1, description="share of objects for validation")
    test_fraction: float = Field(0.25, gt=0, lt=1, description="share of objects for test")

    @model_validator(mode="after")
    def _leaves_training_objects(self) -> Self:
        if self.val_fraction + self.test_fraction >= 1:
            raise ValueError("val_fraction + test_fraction must leave objects for training")
        return self
