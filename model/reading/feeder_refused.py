"""What a feeder file may not hold because no part of the model is like it, and what it is.

Each pair is a pattern of what people write and the reason it is refused with. A key or text
that no pattern fits is an ordinary mistake, answered with the nearest that is known.
"""

from __future__ import annotations

__all__ = ["CONNECTIONS", "DER_MODELS", "KEYS", "LOAD_CONNECTIONS", "NEUTRALS"]

_Pairs = tuple[tuple[str, str], ...]

_PHASES = (
    r"phases?|n_?phases?|[a-z]+_[abc]",
    "every part has three phases; one- and two-phase parts have no model",
)
_CLOCK = r"1?[0-9]?"

CONNECTIONS: _Pairs = (
    (rf"YNyn{_CLOCK}|Yny[gn]", "a vector group, written Yg/Yg whatever its clock"),
    (rf"Dyn{_CLOCK}", "a vector group, written D/Yg whatever its clock"),
    (rf"YNd{_CLOCK}", "a vector group, written Yg/D whatever its clock"),
    (rf"Yd{_CLOCK}", "a vector group, written Y/D whatever its clock"),
    (rf"Dd{_CLOCK}", "a vector group, written D/D whatever its clock"),
    (
        rf"(Y|Yg|D|YN)/?Y{_CLOCK}",
        "a low-voltage wye winding without a grounded neutral, which has no model",
    ),
    (
        rf"Y/?(Yg|yn){_CLOCK}",
        "an ungrounded wye winding above a grounded one, whose neutral has no model",
    ),
    (r".*z.*", "a zigzag winding, which has no model"),
    (r"V.*|open.*", "an open bank of two units, which has no model"),
    (
        r"1|1ph.*|single.*|split.*|cent(er|re).*|swer.*|i",
        "a single-phase unit, which has no model: banks have three phases",
    ),
    (r".*/.*/.*|three.winding.*", "a three-winding unit, which has no model"),
    (r"auto.*|ya.*", "an autotransformer; one that regulates belongs into [[regulators]]"),
    (r"scott.*|le.?blanc.*", "a bank between two and three phases, which has no model"),
)
"""Of transformers."""

LOAD_CONNECTIONS: _Pairs = (
    (r"open.*|v.*", "an open-delta load, which has no model"),
    (r"single.*|1.*|[abc]{1,2}|[abc]-?[nabc]", "a single-phase load, which has no model"),
    (r"(floating|ungrounded).*|y", "a wye load without a neutral, which is written delta"),
)
"""Of loads and capacitors."""

DER_MODELS: _Pairs = (
    (r"pq|constant_pq|p_?q", "constant P and Q, written constant_power"),
    (r"(constant_)?(impedance|z)", "a constant impedance, which is a load"),
    (r"current|inverter|grid_following", "an inverter, written constant_current or constant_power"),
    (r"grid_forming|voltage.*|battery", "a voltage behind an impedance, written thevenin"),
    (r"(synchronous|induction|machine|rotating).*", "a rotating machine, written generator"),
    (r"dfig|type_?[1-4]", "a wind turbine's control, which has no model of its own"),
)

NEUTRALS: _Pairs = (
    (r"grounded|earthed|direct.*|effective.*", "a grounded neutral, written solid"),
    (r"resistance|resistive|ngr|low.*|high.*", "a resistor in the neutral, written resistor"),
    (r"(resonan|compensat|coil|peterson|arc).*|reactor", "a coil in the neutral, written petersen"),
    (r"ungrounded|floating|none|insulated|unearthed", "no neutral to earth, written isolated"),
    (r"zigzag|grounding.*|earthing.*", "an earthing transformer, which is part of z0_ohm"),
)

KEYS: dict[str, _Pairs] = {
    "": (
        (r"sources", "there is one source; feeders of two sources have no model"),
        (
            r"pvs?|solar|inverters?|wind|batter(y|ies)|storages?|generat(or|ion)s?|machines?",
            "[[ders]]",
        ),
        (r"motors?", "part of a load, its motor_share"),
        (r"cables?|branch(es)?", "a line, written [[lines]]"),
        (r"reclosers?|breakers?|sectionali[sz]ers?|fuses?|ties?", "a switch, written [[switches]]"),
        (r"shunts?|reactors?", "a shunt reactor, which has no model"),
        (r"(zigzag|grounding|earthing).*", "an earthing transformer, which has no model"),
        (r"buses|nodes", "buses are made by the lines, switches and regulators that end there"),
        (r"faults?|events?", "events belong into the study file"),
    ),
    "tables": ((r"regulators|sections|source", "this table stands in the feeder file itself"),),
    "source": (
        (
            r"scc.*|mva.*|short_circuit.*",
            "given by z1_ohm: kv_ll squared over the short-circuit MVA",
        ),
    ),
    "lines": (
        _PHASES,
        (
            r".*(matrix|mutual|_abc|z_aa|z_ab).*|[rxz]_ohm.*|geometry|conductors?|spacing",
            "lines are transposed, given by z1_ohm_per_km and z0_ohm_per_km",
        ),
        (r"z2.*", "a transposed line has the same impedance to the negative sequence"),
        (r"[bcy][01]?_(us|ns|s|f|uf|siemens).*", "charging is given by c1_nf_per_km, c0_nf_per_km"),
    ),
    "transformers": (
        _PHASES,
        (
            r"from|to|lv_?.*|secondary.*|to_bus|from_bus",
            "a transformer hangs at one place with its loads; one between two buses has no model",
        ),
        (r"clock|vector_?group", "the windings are given by connection"),
        (r"tap.*|ratio.*", "a tap changer of a hanging transformer has no model"),
        (r"tertiary.*", "a three-winding unit, which has no model"),
        (r"windings?", "the windings are given by connection"),
    ),
    "loads": (
        (r"kva|kvar|q_kvar|mva", "power is given by kw and power_factor"),
        (r"zip.*|cvr.*|model", "how power goes with voltage is given by exponent"),
        _PHASES,
    ),
    "ders": (
        (r"kva|kvar|mva", "power is given by kw and power_factor"),
        (r"control|volt_?var.*|inertia.*|exciter.*", "controls have no model"),
        _PHASES,
    ),
    "capacitors": (
        (r"control.*|on|off|switched", "controls have no model; switching is an event"),
        _PHASES,
    ),
    "regulators": (
        (
            r"connection|(open|closed)_?delta",
            "three units in grounded wye; open- and closed-delta regulators have no model",
        ),
        (
            r"ldc.*|band.*|vreg|v_?target.*|delay.*|set_?point.*|r|x",
            "controls do not act within the event; give the taps",
        ),
        (r".*(ohm|leakage|impedance).*", "a regulator has no impedance here"),
        _PHASES,
    ),
    "switches": (_PHASES, (r".*ohm.*", "a switch has no impedance")),
    "points": (_PHASES,),
    "sections": (),
}
"""Keys by table, those of the document under the empty name."""
