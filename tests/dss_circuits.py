"""Small OpenDSS circuits, one for each thing that an import must take over exactly."""

HEAD = (
    "clear",
    "set defaultbasefrequency=60",
    "new circuit.small basekv=12.47 pu=1.02 angle=10 r1=0.2 x1=1.1 r0=0.3 x0=1.9 bus1=s",
)

TAIL = (
    "set voltagebases=[12.47 4.16 0.48 0.208]",
    "calcvoltagebases",
)

TRUNK = (
    "new linecode.oh nphases=3 units=mi",
    "~ rmatrix=(0.3465 | 0.1560 0.3375 | 0.1580 0.1535 0.3414)",
    "~ xmatrix=(1.0179 | 0.5017 1.0478 | 0.4236 0.3849 1.0348)",
    "~ cmatrix=(15.1 | -4.8 15.9 | -3.0 -1.9 14.3)",
    "new linecode.two nphases=2 units=km rmatrix=(0.9 | 0.1 0.95) xmatrix=(0.8 | 0.3 0.85)",
    "~ cmatrix=(9 | -2 9)",
    "new line.trunk bus1=s bus2=m linecode=oh length=8000 units=ft",
)

LOADS = (
    "new load.la bus1=m.1 phases=1 kv=7.2 kw=300 kvar=100 model=1 vminpu=0.8 vmaxpu=1.2",
    "new load.lb bus1=m.2 phases=1 kv=7.2 kw=200 kvar=150 model=2",
    "new load.lc bus1=m.3.1 phases=1 kv=12.47 conn=delta kw=150 kvar=20 model=5",
)

CIRCUITS = {
    "transposed phases": (
        "new line.l1 bus1=m.3.2.1 bus2=b.3.2.1 linecode=oh length=1 units=mi",
        "new line.l2 bus1=b.3.1 bus2=c.3.1 phases=2 linecode=two length=0.4 units=km",
        "new line.l3 bus1=c.1 bus2=d.1 phases=1 r1=1 x1=2 r0=1 x0=2 c1=3 c0=3 length=200 units=m",
        "new load.ld bus1=d.1 phases=1 kv=7.2 kw=50 pf=0.9",
        "new load.lcc bus1=c.3 phases=1 kv=7.2 kw=70 pf=-0.95",
    ),
    "sequence impedances": (
        "new line.l1 bus1=m bus2=b r1=0.3 x1=0.6 r0=0.5 x0=1.8 c1=11 c0=5 length=3 units=kft",
        "new load.l bus1=b phases=3 kv=12.47 kw=900 pf=0.95 model=3",
    ),
    "switches and fuses": (
        "new line.sw bus1=m bus2=b switch=y r1=1e-4 r0=1e-4 x1=0 x0=0 c1=0 c0=0",
        "new line.lat bus1=b.2 bus2=c.2 phases=1 r1=1 x1=2 r0=1 x0=2 length=1 units=km",
        "new line.tie bus1=b bus2=t linecode=oh length=1 units=mi",
        "new line.open bus1=t bus2=m linecode=oh length=2 units=mi",
        "open line.open 2",
        "new fuse.f1 monitoredobj=line.lat monitoredterm=1",
        "new recloser.r1 monitoredobj=line.tie monitoredterm=2",
        "new load.l bus1=c.2 phases=1 kv=7.2 kw=100 pf=0.9",
        "new load.lt bus1=t phases=3 kv=12.47 kw=100 pf=0.9",
    ),
    "lines side by side": (
        "new line.a bus1=m.1 bus2=b.1 phases=1 r1=1 x1=2 r0=1 x0=2 length=1 units=km",
        "new line.b bus1=b.2 bus2=m.2 phases=1 r1=2 x1=1 r0=2 x0=1 length=2 units=km",
        "new line.c bus1=m.3 bus2=b.3 phases=1 r1=1 x1=1 r0=1 x0=1 length=3 units=km",
        "new load.l bus1=b phases=3 kv=12.47 conn=delta kw=300 pf=0.9",
    ),
    "loop": (
        "new line.l1 bus1=m bus2=b linecode=oh length=1 units=mi",
        "new line.l2 bus1=m bus2=c linecode=oh length=2 units=mi",
        "new line.l3 bus1=b bus2=c linecode=oh length=1 units=mi",
        "new line.l4 bus1=b bus2=c linecode=oh length=3 units=mi",
        "new load.l bus1=c phases=3 kv=12.47 kw=600 pf=0.9",
    ),
    "neutral conductor": (
        "new linecode.four nphases=4 units=km",
        "~ rmatrix=(0.5 | 0.1 0.5 | 0.1 0.1 0.5 | 0.1 0.1 0.1 0.6)",
        "~ xmatrix=(1.0 | 0.4 1.0 | 0.4 0.4 1.0 | 0.4 0.4 0.4 1.1)",
        "new line.l1 bus1=m.1.2.3.0 bus2=b.1.2.3.0 phases=4 linecode=four length=2 units=km",
        "new load.l bus1=b phases=3 kv=12.47 kw=600 pf=0.9",
        "new load.l2 bus1=b.2 phases=1 kv=7.2 kw=100 pf=0.9",
    ),
    "series reactor": (
        "new reactor.x bus1=m bus2=b r=0.2 x=1.5",
        "new load.l bus1=b phases=3 kv=12.47 kw=600 pf=0.9",
    ),
    "shunt reactors": (
        "new reactor.x bus1=m kv=12.47 kvar=300",
        "new reactor.y bus1=m conn=delta kv=12.47 kvar=200",
    ),
    "capacitors": (
        "new capacitor.wye bus1=m phases=3 kv=12.47 kvar=600",
        "new capacitor.delta bus1=m phases=3 conn=delta kv=12.47 kvar=150",
        "new capacitor.star bus1=m bus2=m.4.4.4 phases=3 kv=12.47 kvar=300",
        "new capacitor.one bus1=m.2 phases=1 kv=7.2 kvar=50",
        "new capacitor.across bus1=m.1 bus2=m.3 phases=1 kv=12.47 kvar=60",
        "new capacitor.steps bus1=m phases=3 kv=12.47 numsteps=3 kvar=[100 200 300] states=[1 0 1]",
        "new capacitor.off bus1=m phases=3 kv=12.47 kvar=900 states=[0]",
    ),
    "load multiplier": (
        "new load.fixed bus1=m phases=3 kv=12.47 kw=500 pf=0.9 status=fixed",
        "set loadmult=0.6",
    ),
    "two-phase loads": (
        "new load.w bus1=m.1.3 phases=2 kv=12.47 kw=200 pf=0.9",
        "new load.d bus1=m.1.2.3 phases=2 conn=delta kv=12.47 kw=200 pf=0.9 model=2",
        "new load.x bus1=m.1.2 phases=1 kv=12.47 kw=80 kvar=10 model=8 "
        "zipv=(0.5 0.2 0.3 0.1 0.4 0.5 0)",
        "new load.y bus1=m.2 phases=1 kv=7.2 kw=80 kvar=30 model=8 "
        "zipv=(0.6 0.3 0.1 0.2 0.2 0.6 0)",
    ),
    "allocated loads": (
        "new load.k bus1=m phases=3 kv=12.47 xfkva=500 allocationfactor=0.6 pf=0.95",
        "new load.h bus1=m.1 phases=1 kv=7.2 kva=100 pf=0.8",
    ),
    "opened elements": (
        "new load.off bus1=m phases=3 kv=12.47 kw=400",
        "new line.l1 bus1=m bus2=b linecode=oh length=1 units=km",
        "new load.on bus1=b phases=3 kv=12.47 kw=400 model=2",
        "open load.off 1",
        "open line.l1 1 2",
    ),
    "dead phases": (
        "new line.l1 bus1=m.1.2 bus2=b.1.2 phases=2 linecode=two length=1 units=km",
        "new line.l2 bus1=b bus2=c linecode=oh length=1 units=km",
        "new load.l bus1=c phases=3 kv=12.47 kw=300 pf=0.9 model=2",
        "new load.island bus1=far phases=3 kv=12.47 kw=500 pf=0.9",
    ),
}

_SECONDARY = (
    "new line.sec bus1=b bus2=c r1=0.05 x1=0.06 r0=0.1 x0=0.2 c1=0 c0=0 length=100 units=m",
    "new load.sa bus1=c.1.2 phases=1 kv=4.16 conn=delta kw=200 kvar=90 model=2",
    "new load.sb bus1=c.2.3 phases=1 kv=4.16 conn=delta kw=100 kvar=10 model=1 vminpu=0.7",
)
_EARTHED = ("new load.sc bus1=c.3 phases=1 kv=2.4 kw=100 kvar=10 model=5",)


def unit(connections: str, more: str = "", *, high: str = "m", low: str = "b") -> str:
    """Return the command of a three-phase transformer."""
    return (
        f"new transformer.t phases=3 windings=2 buses=({high} {low}) conns=({connections}) "
        f"kvs=(12.47 4.16) kvas=(1500 1500) xhl=6 %rs=(0.4 0.6) {more}"
    )


TRANSFORMERS = {
    "wye wye": (unit("wye wye", "%noloadloss=0.3 %imag=0.8"), *_SECONDARY, *_EARTHED),
    "delta wye": (unit("delta wye", "taps=(1.025 0.975)"), *_SECONDARY, *_EARTHED),
    "delta wye lead": (unit("delta wye", "leadlag=lead"), *_SECONDARY, *_EARTHED),
    "wye delta": (unit("wye delta"), *_SECONDARY),
    "wye delta lead": (unit("wye delta", "leadlag=lead"), *_SECONDARY),
    "delta delta": (unit("delta delta"), *_SECONDARY),
    "neutral by rneut": (
        unit("wye wye", "wdg=2 rneut=2 xneut=1", low="b.1.2.3.4"),
        *_SECONDARY,
        *_EARTHED,
    ),
    "neutral by reactor": (
        unit("delta wye", low="b.1.2.3.4"),
        "new reactor.n bus1=b.4 bus2=b.0 phases=1 r=0.5 x=2",
        *_SECONDARY,
        *_EARTHED,
    ),
    "turned phases": (unit("delta wye", high="m.2.3.1", low="b.2.3.1"), *_SECONDARY, *_EARTHED),
    "other phases": (unit("delta wye", high="m.1.2.3", low="b.2.3.1"), *_SECONDARY, *_EARTHED),
    "wrong sequence": (unit("delta wye", high="m.2.1.3", low="b.2.1.3"), *_SECONDARY, *_EARTHED),
    "two coils of three": (
        "new transformer.t phases=2 windings=2 buses=(m.1.2 b.1.2) conns=(wye wye) "
        "kvs=(12.47 4.16) kvas=(500 500) xhl=4",
        "new load.l bus1=b.1 phases=1 kv=2.4 kw=100 pf=0.9",
        "new load.k bus1=b.2 phases=1 kv=2.4 kw=150 pf=0.9",
    ),
    "open wye open delta": (
        "new transformer.t1 phases=1 windings=2 buses=(m.1 b.1.2) kvs=(7.2 0.24) "
        "conns=(wye delta) kvas=(50 50) xhl=3",
        "new transformer.t2 phases=1 windings=2 buses=(m.2 b.2.3) kvs=(7.2 0.24) "
        "conns=(wye delta) kvas=(50 50) xhl=3",
        "new load.l bus1=b phases=3 conn=delta kv=0.24 kw=30 pf=0.9",
        "new load.e bus1=b.1 phases=1 kv=0.12 kw=3 pf=0.9",
    ),
    "centre-tap": (
        "new transformer.t phases=1 windings=3 buses=(m.2 b.1.0 b.0.2) kvs=(7.2 0.12 0.12) "
        "kvas=(25 25 25) %rs=(0.6 1.2 1.2) xhl=2.04 xht=2.04 xlt=1.36 %noloadloss=0.4 %imag=0.5",
        "new line.sv bus1=b.1.2 bus2=c.1.2 phases=2 rmatrix=(0.9 | 0.4 0.9) "
        "xmatrix=(0.5 | 0.4 0.5) cmatrix=(3 | -1 3) length=30 units=m",
        "new load.one bus1=c.1 phases=1 kv=0.12 kw=5 pf=0.95",
        "new load.two bus1=c.2 phases=1 kv=0.12 kw=3 pf=0.9",
        "new load.both bus1=c.1.2 phases=1 kv=0.24 kw=4 pf=0.9",
    ),
    "unequal legs": (
        "new transformer.t phases=1 windings=3 buses=(m.3.1 b.1.0 b.0.2) conns=(delta wye wye) "
        "kvs=(12.47 0.24 0.24) kvas=(50 50 50) xhl=2.46",
        "new load.one bus1=b.1 phases=1 kv=0.24 kw=8 pf=0.95",
        "new load.two bus1=b.2 phases=1 kv=0.24 kw=3 pf=0.9",
    ),
    "legs by default": (
        "new transformer.t phases=1 windings=3 buses=(m.2 b.1.0 b.0.2) kvs=(7.2 .12 .12) "
        "kvas=(25 25 25)",
        "new load.both bus1=b.1.2 phases=1 kv=.24 kw=4",
    ),
    "earth return": (
        "new transformer.t phases=1 windings=2 buses=(m.1.2 b.1) conns=(delta wye) "
        "kvs=(12.47 12.7) kvas=(100 100) xhl=4",
        "new line.w bus1=b.1 bus2=c.1 phases=1 r1=3 x1=1 r0=3 x0=1 c1=5 c0=5 length=5 units=km",
        "new transformer.u phases=1 windings=2 buses=(c.1 d.1) kvs=(12.7 0.24) kvas=(25 25) xhl=3",
        "new load.one bus1=d.1 phases=1 kv=0.24 kw=8 pf=0.95",
    ),
}

_BEHIND = (
    "new line.sec bus1=b bus2=c linecode=oh length=1 units=mi",
    "new load.sa bus1=c.1 phases=1 kv=7.2 kw=200 kvar=90",
    "new load.sb bus1=c.2.3 phases=1 kv=12.47 conn=delta kw=100 kvar=10",
)


def regulators(taps: dict[int, float]) -> tuple[str, ...]:
    """Return the commands of single-phase regulators from m to b on some phases."""
    found = []
    for phase, tap in taps.items():
        found.append(
            f"new transformer.r{phase} phases=1 windings=2 bank=r buses=(m.{phase} b.{phase}) "
            f"kvs=(7.2 7.2) kvas=(2000 2000) xhl=1 taps=(1 {tap})"
        )
        found.append(f"new regcontrol.r{phase} transformer=r{phase} winding=2 vreg=120 band=2")
    return tuple(found)


REGULATORS = {
    "three": (*regulators({1: 1.05, 2: 0.9875, 3: 1.00625}), *_BEHIND),
    "open delta": (
        "new transformer.ra phases=1 windings=2 bank=r buses=(m.1.2 b.1.2) conns=(delta delta) "
        "kvs=(12.47 12.47) kvas=(2000 2000) xhl=1 taps=(1 1.05)",
        "new regcontrol.ra transformer=ra winding=2",
        "new transformer.rc like=ra bank=r buses=(m.3.2 b.3.2) taps=(1 1.025)",
        "new line.jumper phases=1 bus1=m.2 bus2=b.2 r0=1e-3 r1=1e-3 x0=0 x1=0 c0=0 c1=0",
        "new load.s bus1=b.1.2 phases=1 kv=12.47 conn=delta kw=200 kvar=90",
        "new load.t bus1=b.2.3 phases=1 kv=12.47 conn=delta kw=100 kvar=10",
    ),
    "gang": (
        "new transformer.r phases=3 windings=2 buses=(m b) kvs=(12.47 12.47) kvas=(5000 5000) "
        "xhl=0.5 taps=(1 1.0375)",
        "new regcontrol.r transformer=r winding=2",
        *_BEHIND,
    ),
    "tap changer": (
        unit("delta wye", "wdg=2 tap=0.95625", low="b.1.2.3.4"),
        "new reactor.n bus1=b.4 bus2=b.0 phases=1 x=0.5",
        "new regcontrol.t transformer=t winding=2",
        *_SECONDARY,
        *_EARTHED,
    ),
    "no whole tap": (*regulators({1: 1.0407}), "new load.x bus1=b.1 kv=7.2 phases=1 kw=90"),
    "two phases": (
        *regulators({1: 1.05, 3: 1.1}),
        "new load.x bus1=b.1.3 kv=12.47 phases=1 conn=delta kw=90",
    ),
    "closed delta": (
        "new transformer.ra phases=1 windings=2 buses=(m.1.2 b.1.2) conns=(delta delta) "
        "kvs=(12.47 12.47) kvas=(2000 2000) xhl=1 taps=(1 1.05)",
        "new transformer.rb like=ra buses=(m.2.3 b.2.3) taps=(1 1.025)",
        "new transformer.rc like=ra buses=(m.3.1 b.3.1) taps=(1 1.0)",
        "new load.s bus1=b.1.2 phases=1 kv=12.47 conn=delta kw=200 kvar=90 model=2",
        "new load.g bus1=b.1 phases=1 kv=7.2 kw=20 kvar=9 model=2",
    ),
}

EVERY = {**CIRCUITS, **TRANSFORMERS, **REGULATORS}


def script(commands: tuple[str, ...]) -> str:
    """Return the file of a small circuit."""
    return "\n".join((*HEAD, *TRUNK, *LOADS, *commands, *TAIL)) + "\n"
