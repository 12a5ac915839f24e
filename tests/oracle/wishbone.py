"""Planar double wishbone, solved without any part of the product.

Every body is free (x, z, angle) and the joints are constraints with Lagrange multipliers:

    [ M  -G^T ] [ q'' ]   [ Q     ]
    [ G   0   ] [ lam ] = [ gamma ]                                                        (1)

One dense solve of (1) gives the accelerations of all bodies and, as multipliers, the joint forces. The positions
never drift: the integrated coordinates are minimal (one angle; three with a bushing at D) and all others follow from
them in closed form. All angles and displacements are measured from the design position, so a bushing of 2e10 N/m sees
its deflection without cancellation. Integrator: scipy's DOP853, restarted at every sample and at every kink of the load.

Written from the equations of motion of free rigid bodies; it shares neither code nor formulation (two-ports, minimal
element coordinates) with the product.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

#: Joint letters in the order of the constraints; each has an x and a z row.
JOINTS = ("A", "B", "C", "D")
LOWER, CARRIER, UPPER = range(3)


def vec(x, z):
    """A vector of the x-z plane."""
    return np.array([x, z], dtype=float)


def turn(p):
    """d(R p)/d(angle): p turned by a quarter from x towards z."""
    return np.array([-p[1], p[0]])


def cross(p, F):
    """Moment of the force F at p, positive from x towards z."""
    return p[0] * F[1] - p[1] * F[0]


def rotate(angle, p):
    """p after the turn by `angle`."""
    return p + shift(angle, p)


def shift(angle, p):
    """R(angle) p - p without cancellation at small angles."""
    half = np.sin(0.5 * angle)
    return -2.0 * half * half * p + np.sin(angle) * turn(p)


@dataclass(frozen=True)
class Wishbone:
    """Parameters; the defaults are the scene `wishbone_paper`."""

    A: np.ndarray = field(default_factory=lambda: vec(0.0, 0.0))
    B: np.ndarray = field(default_factory=lambda: vec(0.40, -0.02))
    C: np.ndarray = field(default_factory=lambda: vec(0.36, 0.27))
    D: np.ndarray = field(default_factory=lambda: vec(0.08, 0.25))
    G: np.ndarray = field(default_factory=lambda: vec(0.48, 0.12))
    P: np.ndarray = field(default_factory=lambda: vec(0.50, 0.12))
    T: np.ndarray = field(default_factory=lambda: vec(0.22, 0.62))
    m_lower: float = 4.0
    m_carrier: float = 25.0
    m_upper: float = 2.5
    I_carrier: float = 0.8
    s1: float = 0.14
    k: float = 22000.0
    c: float = 1000.0
    preload: float = 0.0
    gravity: np.ndarray = field(default_factory=lambda: vec(0.0, 0.0))
    #: Force at P: offset + amplitude sin(omega t).
    offset: np.ndarray = field(default_factory=lambda: vec(0.0, 0.0))
    amplitude: np.ndarray = field(default_factory=lambda: vec(0.0, 10.0))
    omega: float = 10.0
    #: Half-sine pulse at P: amplitude, start, duration (0 = none).
    pulse: np.ndarray = field(default_factory=lambda: vec(0.0, 0.0))
    pulse_start: float = 0.0
    pulse_duration: float = 0.0
    #: Start of the lower link, relative to the design position, and its rate.
    start_angle: float = 0.0
    start_rate: float = 0.0
    #: None: rigid joint at D; (k, c): the upper link's end is held by a spring-damper.
    bushing: tuple[float, float] | None = None

    def __post_init__(self):
        set_ = lambda name, value: object.__setattr__(self, name, value)
        rod = lambda m, r: m * float(r @ r) / 12.0
        lower, upper = self.B - self.A, self.C - self.D
        set_("mass", np.array([self.m_lower, self.m_carrier, self.m_upper]))
        set_("inertia", np.array([rod(self.m_lower, lower), self.I_carrier, rod(self.m_upper, upper)]))
        # centres of mass and joints at the design position
        centre = [0.5 * (self.A + self.B), self.G, 0.5 * (self.D + self.C)]
        set_("centre", centre)
        # (body, point relative to its centre) on either side of a joint; ground is None
        set_(
            "sides",
            {
                "A": ((LOWER, self.A - centre[LOWER]), None),
                "B": ((LOWER, self.B - centre[LOWER]), (CARRIER, self.B - centre[CARRIER])),
                "C": ((CARRIER, self.C - centre[CARRIER]), (UPPER, self.C - centre[UPPER])),
                "D": ((UPPER, self.D - centre[UPPER]), None),
            },
        )
        set_("S", self.D + self.s1 * upper / np.hypot(*upper))
        set_("l0", float(np.hypot(*(self.T - self.S))))
        set_("joints", JOINTS if self.bushing is None else JOINTS[:3])

    @property
    def theta1_0(self):
        """Angle of the lower link at the design position [rad]."""
        return float(np.arctan2(*(self.B - self.A)[::-1]))

    @property
    def theta3_0(self):
        """Angle of the upper link, D to C, at the design position [rad]."""
        return float(np.arctan2(*(self.C - self.D)[::-1]))

    # position and rates -------------------------------------------------------------------------------------------
    def angles(self, x):
        """Angles of the three bodies, measured from the design position, from the minimal coordinates."""
        if self.bushing is not None:
            return np.array(x[:3])
        lower = x[0]
        r_AB, r_BC, r_DC = self.B - self.A, self.C - self.B, self.C - self.D
        # C on two circles, around B and around D, on the side where the design has it
        to_D = self.D - (self.B + shift(lower, r_AB))
        d, r, R = np.hypot(*to_D), np.hypot(*r_BC), np.hypot(*r_DC)
        along = (d * d + r * r - R * R) / (2.0 * d)
        side = np.sign(cross(self.D - self.B, r_BC))
        e = to_D / d
        height = r * r - along * along
        if height < 0.0:
            raise ValueError(f"loop cannot close: |BD| = {d:.6g} m, |BC| = {r:.6g} m, |DC| = {R:.6g} m")
        BC = along * e + side * np.sqrt(height) * turn(e)
        carrier = np.arctan2(cross(r_BC, BC), r_BC @ BC)
        DC = BC - to_D
        upper = np.arctan2(cross(r_DC, DC), r_DC @ DC)
        for _ in range(2):  # polish the rounding of the closed form
            gap = shift(lower, r_AB) + shift(carrier, r_BC) - shift(upper, r_DC)
            J = np.column_stack([turn(rotate(carrier, r_BC)), -turn(rotate(upper, r_DC))])
            step = np.linalg.solve(J, -gap)
            carrier, upper = carrier + step[0], upper + step[1]
        return np.array([lower, carrier, upper])

    def rates(self, x, angle):
        """Angular rates of the three bodies from the minimal coordinates' rates."""
        if self.bushing is not None:
            return np.array(x[3:6])
        columns = [
            turn(rotate(angle[LOWER], self.B - self.A)),
            turn(rotate(angle[CARRIER], self.C - self.B)),
            -turn(rotate(angle[UPPER], self.C - self.D)),
        ]
        others = np.linalg.solve(np.column_stack(columns[1:]), -columns[0] * x[1])
        return np.array([x[1], *others])

    def force_at_P(self, t):
        """External force at P [N]."""
        F = self.offset + self.amplitude * np.sin(self.omega * t)
        since = t - self.pulse_start
        if 0.0 <= since <= self.pulse_duration and self.pulse_duration > 0.0:
            F = F + self.pulse * np.sin(np.pi * since / self.pulse_duration)
        return F

    def kinks(self):
        """Times at which the load is not smooth [s]."""
        return (self.pulse_start, self.pulse_start + self.pulse_duration) if self.pulse_duration > 0.0 else ()

    # equation (1) -------------------------------------------------------------------------------------------------
    def solve(self, t, x):
        """Everything at one state: accelerations, joint forces, positions, powers, energies."""
        angle = self.angles(x)
        rate = self.rates(x, angle)
        # displacement of each body's centre from the design: along the tree A -> lower -> carrier -> upper
        r = lambda body, point: rotate(angle[body], point - self.centre[body])
        B = shift(angle[LOWER], self.B - self.A)
        C = B + shift(angle[CARRIER], self.C - self.B)
        v_B = rate[LOWER] * turn(rotate(angle[LOWER], self.B - self.A))
        v_C = v_B + rate[CARRIER] * turn(rotate(angle[CARRIER], self.C - self.B))
        moved = lambda body, start, start_at, point: start + shift(angle[body], point - start_at)
        v_at = lambda body, v, start_at, point: v + rate[body] * turn(rotate(angle[body], point - start_at))

        Q = np.zeros(9)
        power_in = power_strut = 0.0

        def apply(body, point, F):
            Q[3 * body : 3 * body + 2] += F
            Q[3 * body + 2] += cross(r(body, point), F)

        for body in range(3):
            Q[3 * body : 3 * body + 2] += self.mass[body] * self.gravity

        F_P = self.force_at_P(t)
        v_P = v_at(CARRIER, v_B, self.B, self.P)
        apply(CARRIER, self.P, F_P)
        power_in += F_P @ v_P

        # strut S -> T on the upper link
        S, v_S = moved(UPPER, C, self.C, self.S), v_at(UPPER, v_C, self.C, self.S)
        to_T = (self.T - self.S) - S
        length = np.hypot(*to_T)
        e = to_T / length
        length_rate = -e @ v_S
        stretch = ((to_T + self.T - self.S) @ (to_T - self.T + self.S)) / (length + self.l0)  # length - l0
        F_strut = self.k * stretch + self.c * length_rate - self.preload
        apply(UPPER, self.S, F_strut * e)
        power_strut += self.c * length_rate**2

        # upper link's end at D
        D, v_D = moved(UPPER, C, self.C, self.D), v_at(UPPER, v_C, self.C, self.D)
        F_bushing, bushing_energy = vec(0.0, 0.0), 0.0
        if self.bushing is not None:
            k, c = self.bushing
            F_bushing = -k * D - c * v_D
            apply(UPPER, self.D, F_bushing)
            bushing_energy = 0.5 * k * (D @ D)
            power_strut += c * (v_D @ v_D)

        n = 2 * len(self.joints)
        K = np.zeros((9 + n, 9 + n))
        K[range(9), range(9)] = np.column_stack([self.mass, self.mass, self.inertia]).ravel()
        right = np.zeros(9 + n)
        right[:9] = Q
        for i, joint in enumerate(self.joints):
            rows = slice(9 + 2 * i, 11 + 2 * i)
            for sign, side in zip((1.0, -1.0), self.sides[joint]):
                if side is None:
                    continue
                body, arm = side
                arm = rotate(angle[body], arm)
                G = sign * np.column_stack([np.eye(2), turn(arm)])
                K[rows, 3 * body : 3 * body + 3] += G
                K[3 * body : 3 * body + 3, rows] -= G.T
                right[rows] += sign * rate[body] ** 2 * arm  # centripetal part moved to the right
        solution = np.linalg.solve(K, right)
        accel, force = solution[:9], solution[9:].reshape(-1, 2)

        # velocities of the centres, for the energies
        v = [
            v_at(LOWER, vec(0.0, 0.0), self.A, self.centre[LOWER]),
            v_at(CARRIER, v_B, self.B, self.G),
            v_at(UPPER, v_C, self.C, self.centre[UPPER]),
        ]
        height = [
            moved(LOWER, vec(0.0, 0.0), self.A, self.centre[LOWER]),
            moved(CARRIER, B, self.B, self.G),
            moved(UPPER, C, self.C, self.centre[UPPER]),
        ]
        kinetic = sum(0.5 * m * (v_c @ v_c) + 0.5 * J * w * w for m, v_c, J, w in zip(self.mass, v, self.inertia, rate))
        potential = (
            -sum(m * (self.gravity @ (h + at)) for m, h, at in zip(self.mass, height, self.centre))
            + 0.5 * self.k * stretch**2
            - self.preload * stretch
            + bushing_energy
        )
        return {
            "angle": angle,
            "rate": rate,
            "angle_accel": accel[2::3],
            "B": self.B + B,
            "C": self.C + C,
            "D": D,
            "P": self.P + moved(CARRIER, B, self.B, self.P),
            "A.F": -force[0],
            "B.F": force[1],
            "C.F": force[2],
            "D.F": -force[3] if self.bushing is None else -F_bushing,
            "length": length,
            "power_in": power_in,
            "power_out": power_strut,
            "kinetic": kinetic,
            "potential": potential,
        }

    # integration --------------------------------------------------------------------------------------------------
    def rhs(self, t, y):
        """Minimal coordinates, their rates, supplied and dissipated energy."""
        now = self.solve(t, y)
        if self.bushing is None:
            return np.array([y[1], now["angle_accel"][LOWER], now["power_in"], now["power_out"]])
        return np.array([*y[3:6], *now["angle_accel"], now["power_in"], now["power_out"]])

    def start(self):
        """State at t = 0, with both energy integrals at zero."""
        if self.bushing is None:
            return np.array([self.start_angle, self.start_rate, 0.0, 0.0])
        rigid = Wishbone(**{**self.__dict_of_fields(), "bushing": None})
        x = [self.start_angle, self.start_rate]
        angle = rigid.angles(x)
        return np.array([*angle, *rigid.rates(x, angle), 0.0, 0.0])

    def __dict_of_fields(self):
        return {name: getattr(self, name) for name in self.__dataclass_fields__}

    def integrate(self, times, rtol=3e-14, atol=1e-17):
        """Samples at `times` (the first one is the start): a list of (t, state)."""
        y, t, h = self.start(), float(times[0]), None
        yield t, y
        for end in times[1:]:
            for stop in sorted({k for k in self.kinks() if t < k < end} | {float(end)}):
                # inside a segment the load is smooth; a restart is exact
                out = solve_ivp(self.rhs, (t, stop), y, method="DOP853", rtol=rtol, atol=atol, first_step=h)
                if not out.success:
                    raise RuntimeError(f"no solution at t = {out.t[-1]} s: {out.message}")
                if len(out.t) > 2:
                    h = float(out.t[-2] - out.t[-3])
                y, t = out.y[:, -1], stop
                h = None if h is None else min(h, 0.5 * (times[1] - times[0]))
            yield t, y

    #: Columns of `table`, the ones of the stored references.
    COLUMNS = (
        "t,theta1,theta1_dot,theta1_ddot,psi,psi_dot,theta3,theta3_dot,B.r.x,B.r.z,C.r.x,C.r.z,P.r.x,P.r.z,"
        "A.F.x,A.F.z,B.F.x,B.F.z,C.F.x,C.F.z,D.F.x,D.F.z,strut.length,"
        "energy.kinetic,energy.potential,energy.supplied,energy.dissipated"
    ).split(",")

    def table(self, times, rtol=3e-14, atol=1e-17):
        """One row per time, columns `COLUMNS`."""
        rows = []
        for t, y in self.integrate(times, rtol, atol):
            s = self.solve(t, y)
            angle, rate = s["angle"], s["rate"]
            rows.append(
                [
                    t,
                    self.theta1_0 + angle[LOWER],
                    rate[LOWER],
                    s["angle_accel"][LOWER],
                    angle[CARRIER],
                    rate[CARRIER],
                    self.theta3_0 + angle[UPPER],
                    rate[UPPER],
                    *s["B"],
                    *s["C"],
                    *s["P"],
                    *s["A.F"],
                    *s["B.F"],
                    *s["C.F"],
                    *s["D.F"],
                    s["length"],
                    s["kinetic"],
                    s["potential"],
                    *y[-2:],
                ]
            )
        return np.array(rows)
