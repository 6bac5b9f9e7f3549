"""What a feeder file may not hold because no part of the model is like it, and what it is.

Each pair is a pattern of what people write and the reason it is refused with. A key or text
that no pattern fits is an ordinary mistake, answered with the nearest that is known.
"""

from __future__ import annotations

__all__ = [
    "CONNECTIONS",
    "DER_MODELS",
    "INLINE_CONNECTIONS",
    "KEYS",
    "LOAD_CONNECTIONS",
    "NEUTRALS",
    "REFERENCES",
]

_Pairs = tuple[tuple[str, str], ...]

_THREE_PHASES = (
    r"phases?|n_?phases?|[a-z]+_[abc]",
    "this part has three phases",
)
_PHASES = (r"phase|n_?phases?", "which conductors a part has is given by phases")
_BRANCHES = (
    r"[a-z]+_[abc]{1,2}",
    "all branches of a row are equal; unequal ones are rows of their own, each with its phases",
)
_CLOCK = r"1?[0-9]?"
_BETWEEN = "stands between two buses, in [[inline_transformers]]"

_NO_BANK: _Pairs = (
    (r".*z.*", "a zigzag winding, which has no model"),
    (r".*/.*/.*|three.winding.*", "a three-winding unit, which has no model"),
    (
        r"auto.*|ya.*",
        "an autotransformer; one that regulates belongs into [[regulators]],"
        " others and their tertiaries have no model",
    ),
    (r"scott.*|le.?blanc.*", "a bank between two and three phases, which has no model"),
)

CONNECTIONS: _Pairs = (
    (rf"YNyn{_CLOCK}|Yny[gn]", "a vector group, written Yg/Yg whatever its clock"),
    (rf"Dyn{_CLOCK}", "a vector group, written D/Yg whatever its clock"),
    (rf"YNd{_CLOCK}", "a vector group, written Yg/D whatever its clock"),
    (rf"Yd{_CLOCK}", "a vector group, written Y/D whatever its clock"),
    (rf"Dd{_CLOCK}", "a vector group, written D/D whatever its clock"),
    (
        rf"(Y|Yg|D|YN)/?Y{_CLOCK}",
        f"a low-voltage wye winding without a grounded neutral, which {_BETWEEN}",
    ),
    (
        rf"Y/?(Yg|yn){_CLOCK}",
        f"an ungrounded wye winding above a grounded one, which {_BETWEEN}",
    ),
    *_NO_BANK[:1],
    (
        r"V.*|open.*",
        "an open bank of two units, which stand between two buses, in [[inline_transformers]]",
    ),
    (r"1|1ph.*|single.*|split.*|cent(er|re).*|swer.*|i", f"a single-phase unit, which {_BETWEEN}"),
    *_NO_BANK[1:],
)
"""Of transformers that hang on the feeder."""

INLINE_CONNECTIONS: _Pairs = (
    (rf"YNyn{_CLOCK}|Yny[gn]", "a vector group, written Yg/Yg"),
    (r"Dyn11", "a vector group, written D/Yg with shift = 'lead'"),
    (r"Dyn1?", "a vector group, written D/Yg with shift = 'lag'"),
    (r"YNd11", "a vector group, written Yg/D with shift = 'lead'"),
    (r"YNd1?", "a vector group, written Yg/D with shift = 'lag'"),
    (r"Dy11", "a vector group, written D/Y with shift = 'lead'"),
    (r"Dy1?", "a vector group, written D/Y with shift = 'lag'"),
    (r"Yd11", "a vector group, written Y/D with shift = 'lead'"),
    (r"Yd1?", "a vector group, written Y/D with shift = 'lag'"),
    (r"Dd0?", "a vector group, written D/D"),
    (r"Yy0?", "a vector group, written Y/Y"),
    (r"Yyn0?", "a vector group, written Y/Yg"),
    (r"(YN|Y|D)(yn?|d)[0-9]+", "a vector group whose clock has no model; those of 0, 1 and 11 do"),
    *_NO_BANK,
    (r"V.*|open.*", "an open bank, written as two rows between the same buses, each 'single'"),
    (r"split.*|cent(er|re).*|3.?wire", "a centre-tapped unit, written centre-tap"),
    (r"1|1.?ph.*|single.*|swer.*|isolation.*|i", "a single-phase unit, written single"),
    (r"unknown", "a connection that a study would draw, which hanging [[transformers]] may have"),
)
"""Of transformers between two buses."""

LOAD_CONNECTIONS: _Pairs = (
    (r"open.*|v.*", "an open delta, written as two rows, each delta with two phases"),
    (
        r"single.*|1.*|[abc]{1,2}|[abc]-?[nabc]",
        "a single-phase part, written wye with one of its phases or delta with two",
    ),
    (r"(floating|ungrounded).*|y", "a wye part without a neutral, which is written delta"),
)
"""Of loads and capacitors."""

REFERENCES: _Pairs = (
    (r"wye|star|y(g|n)?|ground.*|neutral|n|0", "units between phase and earth, written earth"),
    (r"open.?delta", "an open delta, written with the phase that both units refer to"),
    (r"(closed.?)?delta", "a closed delta, written next"),
)
"""Of regulators."""

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
        (r"line_?codes?", "written [[codes]]"),
        (r"(bus_?)?coord.*|positions?", "written [[coordinates]]"),
        (r"reclosers?|breakers?|sectionali[sz]ers?|fuses?|ties?", "a switch, written [[switches]]"),
        (r"shunts?|reactors?", "a shunt reactor, which has no model"),
        (r"(zigzag|grounding|earthing).*", "an earthing transformer, which has no model"),
        (
            r"buses|nodes",
            "buses are made by the lines, transformers, switches and regulators that end there",
        ),
        (r"faults?|events?", "events belong into the study file"),
    ),
    "tables": (
        (r"codes|regulators|sections|source", "this table stands in the feeder file itself"),
    ),
    "source": (
        (
            r"scc.*|mva.*|short_circuit.*",
            "given by z1_ohm: kv_ll squared over the short-circuit MVA",
        ),
    ),
    "codes": (
        (r"[rxc]_?matrix|[rxc]", "matrices are given by r_ohm_per_km, x_ohm_per_km, c_nf_per_km"),
        (r"[zrx][01].*|[bc][01].*", "sequence values belong to lines of their own, without a code"),
        (r"n_?phases|phases?", "which conductors a line has is given by its phases"),
        (r"geometry|wires?|conductors?|spacing|units", "a code is given by its matrices per km"),
    ),
    "lines": (
        _PHASES,
        (
            r".*(matrix|mutual|_abc|z_aa|z_ab).*|[rxz]_ohm.*|geometry|conductors?|spacing",
            "the matrices of untransposed lines stand in [[codes]]",
        ),
        (r"line_?code", "written code"),
        (r"z2.*", "a transposed line has the same impedance to the negative sequence"),
        (
            r"[bcy][01]?_(us|ns|s|f|uf|siemens).*",
            "charging is given by c1_nf_per_km, c0_nf_per_km, or in a code",
        ),
    ),
    "inline_transformers": (
        (r"clock|vector_?group", "the windings are given by connection and shift"),
        (r"tertiary.*", "a three-winding unit, which has no model"),
        (r"windings?", "the windings are given by connection"),
        (r"bus|line|at", "it stands between two buses, from and to"),
        (r"kva", "written rating_kva"),
        (r"taps?", "given by from_tap and to_tap, turns over rated turns"),
    ),
    "transformers": (
        _THREE_PHASES,
        (
            r"from|to|lv_?.*|secondary.*|to_bus|from_bus",
            "a transformer hangs at one place with its loads; one between two buses belongs into"
            " [[inline_transformers]]",
        ),
        (r"clock|vector_?group", "the windings are given by connection"),
        (
            r"tap.*|ratio.*",
            "taps belong to transformers between two buses, [[inline_transformers]]",
        ),
        (r"tertiary.*", "a three-winding unit, which has no model"),
        (r"windings?", "the windings are given by connection"),
    ),
    "loads": (
        (r"kva|mva", "power is given by kw and power_factor, or kw and kvar"),
        (r"q_kvar|kvars", "written kvar"),
        (r"zipv?|cvr.*|model", "how power goes with voltage is given by exponent or zip"),
        _PHASES,
        _BRANCHES,
    ),
    "ders": (
        (r"kva|kvar|mva", "power is given by kw and power_factor"),
        (r"control|volt_?var.*|inertia.*|exciter.*", "controls have no model"),
        _THREE_PHASES,
    ),
    "capacitors": (
        (r"control.*|on|off|switched", "controls have no model; switching is an event"),
        _PHASES,
        _BRANCHES,
    ),
    "regulators": (
        (
            r"connection|(open|closed)_?delta",
            "what its units' voltages are to is given by reference",
        ),
        (
            r"ldc.*|band.*|vreg|v_?target.*|delay.*|set_?point.*|r|x",
            "controls do not act within the event; give the taps",
        ),
        (r"leakage.*|impedance.*", "given by z_ohm, in ohms at from"),
        _PHASES,
    ),
    "switches": (_PHASES, (r".*ohm.*", "a switch has no impedance")),
    "points": (_THREE_PHASES,),
    "sections": (),
    "coordinates": ((r"lat.*|lon.*", "given by x and y, in any unit"),),
}
"""Keys by table, those of the document under the empty name."""
