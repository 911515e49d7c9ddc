"""[referee]: the soft pad, the air and the load by which grasps are judged.

Lengths that grow with the pad are in multiples of its radius r_G, flow is over its area, so that
one section describes pads of all sizes. The figures were fixed before any q was compared with what
comes out; a figure without a published source says «estimate».
"""

from pydantic import Field

from pipeline.config.section import Section


class RefereeConfig(Section):
    """A cushion under a skin, pressed on the surface; air through the gap; a fan; a load."""

    cushion_modulus_pa: float = Field(
        55e3,
        gt=0,
        le=1e8,
        description="modulus of the cushion in compression: 2 psi at 25 %, the bound between "
        "grades 0 and 1 of sponge rubber, ASTM D1056 [Pa]",
    )
    cushion_thickness_rg: float = Field(
        1.2, gt=0, le=10, description="thickness of the cushion: H over r_G, Table I [r_G]"
    )
    skin_modulus_pa: float = Field(
        1.16e6,
        gt=0,
        le=1e9,
        description="modulus of the skin: silicone of Shore A 30, by lg E = 0.0235 S - 0.6403 "
        "(E in MPa; Ruess) [Pa]",
    )
    skin_thickness_rg: float = Field(
        0.02, gt=0, le=1, description="thickness of the skin, 0.5 mm at 25 mm: estimate [r_G]"
    )
    skin_strain: float = Field(
        0.05, ge=0, le=1, description="how far the skin is stretched over the cushion: estimate [1]"
    )
    press_pa: float = Field(
        2500.0,
        gt=0,
        le=1e6,
        description="force of the robot over the pad's area before the air is drawn, 5 N at "
        "25 mm: estimate [Pa]",
    )
    roughness_m: float = Field(
        20e-6,
        gt=0,
        le=1e-3,
        description="height of the film that is left in contact: estimate; suction cups leak "
        "measurably from some micrometres on, Tiwari and Persson, Soft Matter 15 (2019) [m]",
    )
    open_share: float = Field(
        0.02, gt=0, le=1, description="share of the face that is openings: estimate [1]"
    )
    discharge: float = Field(
        0.6, gt=0, le=1, description="discharge coefficient of a sharp-edged orifice; textbooks [1]"
    )
    grain_rg: float = Field(
        0.08,
        gt=0,
        le=1,
        description="diameter of the cushion's grains, 2 mm at 25 mm: estimate [r_G]",
    )
    fan_vacuum_pa: float = Field(
        12e3,
        gt=0,
        le=101_325,
        description="vacuum of the fan where no air flows; class of a side-channel blower of "
        "0.7 kW: estimate [Pa]",
    )
    fan_flow_m_s: float = Field(
        2.3,
        gt=0,
        le=1e3,
        description="free flow of the fan over the pad's area; 145 m3/h on the 75 mm of an "
        "FH-R150: estimate [m/s]",
    )
    fan_exponent: float = Field(
        1.0,
        gt=0,
        le=4,
        description="m of the fan's curve 1 - (Q/Q_0)^m; a side-channel blower's is nearly "
        "straight: 1, a centrifugal fan's: 2 [1]",
    )
    friction: float = Field(
        0.5, gt=0, le=2, description="Coulomb friction of rubber; Supplement I, [1]-[3] [1]"
    )
    lift_acceleration_m_s2: float = Field(
        3.0, ge=0, le=100, description="upwards while lifting, beside gravity [m/s2]"
    )
    side_acceleration_m_s2: float = Field(
        1.0, ge=0, le=100, description="to any side while lifting [m/s2]"
    )
    element_rg: float = Field(
        1 / 16, ge=1 / 64, le=0.5, description="largest side of a finite element, radially [r_G]"
    )
