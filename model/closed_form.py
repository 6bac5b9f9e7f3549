"""The paper's closed forms: what a break does, in sequence quantities, without any solver.

A break in one conductor or more joins the sequence networks at the break. With the break
closed no network sees anything of it; opened, it acts on each sequence k as a voltage
V_pq,k from the upper stub p to the lower stub q, in series with the loop impedance Z_k:
the impedance back to the source from p plus that of everything below q. Only the positive
sequence had a current, I, so

    ΔI_k = -V_pq,k / Z_k,   V_pq,k = -Z_k ΔI_k,

and the boundary conditions of the open phases give V_pq. All of it holds for balanced
linear networks, radial or not, as long as Z_k is the impedance of the whole loop.

Impedances are ohms, currents amperes and voltages volts to earth; arguments are arrays of
shapes that broadcast. Results with a leading axis of 3 are in sequence order 0, 1, 2 and
belong to phase a. An infinite ``z0_ohm`` says that the zero sequence has no path. Functions
called ``..._approx`` are the paper's approximations, with what they leave out in their Notes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .symmetrical import A

__all__ = [
    "break_current",
    "break_voltage",
    "false_trip_probability",
    "frame_turn",
    "least_operating_voltage",
    "z_op1",
    "z_op1_approx",
    "z_op1_loop_approx",
    "z_op_a_four_wire_approx",
    "z_op_a_three_wire_approx",
    "z_op_a_yg_d_approx",
    "z_opposite_steps",
]

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


def break_voltage(
    phases_open: int, i_a: Complex, z1_ohm: Complex, z2_ohm: Complex, z0_ohm: Complex
) -> Complex:
    """Voltage V_pq across a break, by sequence, in the frame of its odd phase.

    Parameters
    ----------
    phases_open : int
        1, 2 or 3. The odd phase is the open one of one, the whole one of two, any of three.
    i_a : complex array
        Positive-sequence current through the place before the break, in the same frame.
    z1_ohm, z2_ohm, z0_ohm : complex arrays
        Loop impedances of the sequence networks at the break. Z1 is finite: an unloaded
        line has no current to lose.

    Returns
    -------
    (3, ...) complex array
        Volts, sequences 0, 1, 2. Three open phases leave the zero sequence of the far side
        to what is there; where nothing is (Z0 infinite) its 0 is a convention.

    Notes
    -----
    *One open* (Fig. 8 of the paper): ΔI0 + ΔI1 + ΔI2 = -I, and the two whole phases make
    the three voltages equal, so that  V_pq = I / (1/Z0 + 1/Z1 + 1/Z2).

    *Two open*: one current I_k = I Z1 / (Z0 + Z1 + Z2) flows in all three networks, and the
    voltages add up to zero.

    *Three open*: the positive-sequence network loses I; the others had nothing.
    """
    if phases_open == 1:
        equal = i_a / (1.0 / z0_ohm + 1.0 / z1_ohm + 1.0 / z2_ohm)
        return _sequences(equal, equal, equal)
    if phases_open == 2:
        left = i_a * z1_ohm / (z0_ohm + z1_ohm + z2_ohm)
        v1, v2 = z1_ohm * (i_a - left), -z2_ohm * left
        return _sequences(-(v1 + v2), v1, v2)
    _check_three(phases_open)
    return _sequences(0j * i_a, z1_ohm * i_a, 0j * i_a)


def break_current(
    phases_open: int,
    i_a: Complex,
    z1_ohm: Complex,
    z2_ohm: Complex,
    z0_ohm: Complex,
    phase: int = 0,
) -> Complex:
    """Change ΔI of the current through a break, by sequence.

    Parameters
    ----------
    phases_open : int
        1, 2 or 3.
    i_a : complex array
        Positive-sequence current of phase a through the place before the break.
    z1_ohm, z2_ohm, z0_ohm : complex arrays
        Loop impedances of the sequence networks at the break.
    phase : int
        The open phase of one, the whole phase of two: 0, 1, 2 for a, b, c.

    Returns
    -------
    (3, ...) complex array
        Amperes, sequences 0, 1, 2 of phase a.

    Notes
    -----
    With Z20 = Z2 Z0 / (Z2 + Z0), one open phase gives

        ΔI1 = -I Z20 / (Z1 + Z20),   ΔI2 = ΔI1 Z1 / Z2,   ΔI0 = ΔI1 Z1 / Z0:

    a third of I where the three are equal (ideal four-wire), half of it where Z0 is
    infinite and Z2 = Z1 (three-wire), and about I Z0 / Z1, falling with the square of the
    load, where Yg/Δ units make Z0 small. Two open phases give ΔI1 = -I (Z0 + Z2) /
    (Z0 + Z1 + Z2) and three ΔI1 = -I.

    The odd phase decides about angles only: seen from phase b, a phasor of sequence 1 is
    turned by a², one of sequence 2 by a, so back in the frame of phase a the changes have
    turned by 1 (sequence 1), a (sequence 2) and a² (sequence 0); for c the other way round.
    """
    if phases_open == 1:
        equal = break_voltage(1, i_a, z1_ohm, z2_ohm, z0_ohm)[0]
        change = _sequences(-equal / z0_ohm, -equal / z1_ohm, -equal / z2_ohm)
    elif phases_open == 2:
        left = i_a * z1_ohm / (z0_ohm + z1_ohm + z2_ohm)
        change = _sequences(left, left - i_a, left)
    else:
        _check_three(phases_open)
        change = _sequences(0j * i_a, -i_a, 0j * i_a)
    return change * np.reshape(frame_turn(phase), (3,) + (1,) * (change.ndim - 1))


def frame_turn(phase: int) -> Complex:
    """(3,) what to multiply ΔI or V_pq with when ``phase`` is the odd one instead of a."""
    return np.array([A**-phase, 1.0, A**phase])


def _sequences(zero: Complex, positive: Complex, negative: Complex) -> Complex:
    return np.stack(np.broadcast_arrays(zero, positive, negative)).astype(np.complex128)


def _check_three(phases_open: int) -> None:
    if phases_open != 3:
        raise ValueError(f"phases_open must be 1, 2 or 3, got {phases_open}")


def z_op1(a: Complex, v_n1: Complex, i_q1: Complex) -> Complex:
    """Positive-sequence connection impedance of a break between m and n, exactly.

    Parameters
    ----------
    a : complex array
        First two-port constant of the path from m to the break, V_m = A V_p + B I_p;
        1 where nothing is connected on it.
    v_n1, i_q1 : complex arrays
        Positive-sequence voltage at n, and current through the place of the break, both
        before it.

    Returns
    -------
    complex array
        Z_mn,op,1 in ohms: with one, two or three open phases and any grounding.

    Notes
    -----
    This is eq. (17) without its approximations. Put V_m = A V_p + B I_p and
    I_m = C V_p + D I_p, AD - BC = 1, into eq. (5). What lies below the break is linear,
    balanced and has no source, so V_n / I_q is one number ζ before and after, and

        numerator   = A (V_p' V_n - V_n' V_p) = A ζ (V_p' I_q - I_q' V_p),
        denominator = I_q' V_p - V_p' I_q,

    hence Z = -A ζ = -A V_n1 / I_q1. Nothing was assumed of the network above m: the source
    impedance does not belong in it, and Z2 and Z0 move ΔI1 but not Z.
    """
    return -a * v_n1 / i_q1


def z_op1_approx(z_s1_ohm: Complex, z_l1_ohm: Complex) -> Complex:
    """Equation (17): -(Z_S1 + Z_L1), source impedance and load beyond the break.

    Notes
    -----
    Replaces the load's own -V_n1 / I_q1 (``z_op1``) by the impedance of the loop. The
    source's term comes from neglecting ΔV_m, eq. (14), and is spurious; it matters little,
    being some thousandth of the load's.
    """
    return -(z_s1_ohm + z_l1_ohm)


def z_op_a_three_wire_approx(z_s_ohm: Complex, z_la_ohm: Complex) -> Complex:
    """Equations (8) and (11): -1.5 (Z_S + Z_LA), phase quantities, three-wire feeder.

    Notes
    -----
    Eq. (8) is the loop of phase a in series with b and c in parallel, for balanced loads.
    Where nothing is connected between m and the break, and beyond it only what has no
    zero-sequence path, the sound phases carry opposite currents afterwards. With Z1 = Z2
    these induce nothing in phase a and cancel in the mean of V_b and V_c, so everywhere
    beyond the break the open conductor takes -V_m,a' / 2, and eq. (5) is exactly
    -(V_n + V_m / 2) / I_q, before the break: again without the source's impedance.
    """
    return -1.5 * (z_s_ohm + z_la_ohm)


def z_op_a_four_wire_approx(z_s_ohm: Complex, z_la_ohm: Complex) -> Complex:
    """Equation (12): -(Z_S + Z_LA), phase quantities, four-wire multi-grounded feeder.

    Notes
    -----
    Takes the phases for uncoupled, so that the open conductor is dead: true where lines
    and loads have Z0 = Z1 = Z2, and then -V_n / I_q, without the source's impedance.
    """
    return -(z_s_ohm + z_la_ohm)


def z_op_a_yg_d_approx(z_s_ohm: Complex, z_t_ohm: Complex, units: Real) -> Complex:
    """Equation (13): -3 (Z_S + Z_T / n), phase quantities, with n equal Yg/Δ units.

    Notes
    -----
    The paper gives n = 1 and says that further units act in parallel. Loads are left out,
    and so are lines and all other ways of the zero sequence to earth, which is why it
    falls too fast with n: 15.7 and 11.3 Ω for two and three units on the paper's feeder,
    where the complete circuit gives 18.0 and 14.4 Ω.
    """
    return -3.0 * (z_s_ohm + z_t_ohm / units)


def z_op1_loop_approx(z_loop_ohm: Complex, z_section_ohm: Complex) -> Complex:
    """Either terminal's Z for a break in a closed loop: -(Z_loop - Z_section).

    Parameters
    ----------
    z_loop_ohm, z_section_ohm : complex arrays
        Positive-sequence line impedance of the whole loop, and of the section in it.

    Notes
    -----
    The rest of the loop joins m and n from outside (Section III-E of the paper, with one
    bus feeding both ends, so that no source impedance remains). The limit of light load:
    loads on the loop add shares of about Z_loop over their own impedance.
    """
    return -(z_loop_ohm - z_section_ohm)


def z_opposite_steps(z_line_ohm: Complex, place: Real, ratio: Complex) -> Complex:
    """Z of a load step in an untapped section together with one beyond it.

    Parameters
    ----------
    z_line_ohm : complex array
        Impedance of the section.
    place : array
        Where in the section the inner step stands, as a fraction from the local terminal.
    ratio : complex array
        r, the outer step's current over the inner one's, both as compensated changes
        ΔI* = I' - I V_m'/V_m.

    Notes
    -----
    Eq. (5) is -ΔV_n* / ΔI_m*. The compensated V_m does not change, the line drops
    Z (f ΔI_in* + ΔI_out*), and m carries their sum: Z_line (f + r) / (1 + r). Alone
    (r = 0) the inner step shows less than the line, the second line of eq. (25); near
    r = -1 the pair shows any impedance.
    """
    return z_line_ohm * (place + ratio) / (1.0 + ratio)


def false_trip_probability(z_set_ohm: Real, di_a: Real, sigma_v: Real, v_v: Real) -> Real:
    """Chance that noise alone makes an external event of size ``di_a`` trip.

    Parameters
    ----------
    z_set_ohm, di_a : arrays
        Impedance setting, ohms, and |ΔI1| of the event, amperes.
    sigma_v : array
        Complex rms error of a positive-sequence voltage phasor, as a share of it.
    v_v : array
        Phase voltage, volts.

    Notes
    -----
    Four voltage phasors enter the numerator of eq. (5), each times about V: its error is
    complex normal of rms 2 σ V². Over a denominator of about ΔI V the impedance is complex
    normal of rms 2 σ V / ΔI, so |Z| exceeds Z_set with probability
    exp(-(Z_set ΔI / (2 σ V))²), half of the time with a negative real part. The line's own
    impedance and the current's errors are neglected: Z_set stands well above the first, and
    ΔI above the second.
    """
    return np.asarray(0.5 * np.exp(-((z_set_ohm * di_a / (2.0 * sigma_v * v_v)) ** 2)))


def least_operating_voltage(probability: Real, sigma_v: Real, v_v: Real) -> Real:
    """Least product Z_set · I_set in volts that holds ``false_trip_probability``.

    The inverse: 2 σ_V V √ln(1 / 2p), for p up to a half.
    """
    return np.asarray(2.0 * sigma_v * v_v * np.sqrt(np.log(0.5 / probability)))
