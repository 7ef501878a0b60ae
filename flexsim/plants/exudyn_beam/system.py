"""The arm in EXUDYN's terms, and its stepping: bodies, joints, cable elements, an implicit rule.

    >>> arm = ArmSystem(Parameters(), elements=8, step=2.5e-4)
    >>> arm.begin(world)                      # (2, n) coordinates and rates
    >>> arm.advance(world, 0.1, 0.0)          # one physics step, torques held [N m]

Two rigid bodies, the ground and `ObjectANCFCable2D` elements (cubic, no rotary inertia of sections,
Euler-Bernoulli), held together by `RevoluteJoint2D`, a `GenericJoint` for the clamp, and one for a
payload. Steps are EXUDYN's trapezoidal rule with constraints on velocities (`TrapezoidalIndex2`):
of second order, without damping of its own.

The rule takes the mean of the loads at both ends of a step, and knows those of its start from the
step before: a torque that jumps between two steps would come half a step late, which these loops
are sensitive to. So a physics step is two of EXUDYN's, with twice the torque at the end of the
first and none at the end of the second: both have the mean that is wanted, exactly, and what is
carried over is always the unloaded arm's.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from flexsim.arm.parameters import Parameters
from flexsim.errors import ParameterError
from flexsim.numerics.types import Array

SLENDERNESS = 270.0  # L sqrt(EA/EI): it stretches by micrometres at most; a steel strip of 1 mm has
# 1730, with which EXUDYN's Newton iterations end in rounding errors
TOLERANCE = 1e-11  # of Newton's increments [m, rad]: 1e-10 is seen in the tip after 2 s, 1e-12 not
STEPS_MOST = 1e12  # of a run: its end is the loop's affair
HALVES = (2.0, 0.0)  # load at the end of each of EXUDYN's steps over the torque
ANGLE = 2  # of a rigid body's coordinates
EXTRA = "flexsim[exudyn]"


def exudyn() -> Any:
    """Return the package, imported when it is first needed.

    Raises:
        ParameterError: it is not installed.
    """
    try:
        import exudyn as package
        import exudyn.itemInterface  # beside the compiled module
    except ImportError as error:
        raise ParameterError(
            f"plant 'exudyn' needs the package exudyn, which cannot be imported ({error}); "
            f"install it with: pip install '{EXTRA}'"
        ) from None
    return package


class ArmSystem:
    """One arm in EXUDYN, straight along x until a run begins.

    Attributes:
        size: n, number of EXUDYN's coordinates.
    """

    def __init__(
        self,
        parameters: Parameters,
        elements: int,
        step: float,
        held: tuple[bool, bool] = (False, False),
    ) -> None:
        self._exu = exudyn()
        self._container = self._exu.SystemContainer()
        self._mbs = self._container.AddSystem()
        self._loads = _assembled(self._mbs, parameters, elements, held)
        self._settings = _settings(self._exu, step / len(HALVES))
        self._step = step / len(HALVES)
        self.size = int(self._mbs.systemData.ODE2Size())

    def begin(self, world: Array) -> None:
        """Set coordinates and rates (2, n), and the unloaded arm's accelerations."""
        data, initial = self._mbs.systemData, self._exu.ConfigurationType.Initial
        self._load(0.0, 0.0)
        data.SetODE2Coordinates(world[0], initial)
        data.SetODE2Coordinates_t(world[1], initial)
        data.SetODE2Coordinates_tt(np.zeros(self.size), initial)
        data.SetAECoordinates(np.zeros(data.AEsize()), initial)
        solver = self._exu.MainSolverImplicitSecondOrder()
        if not solver.InitializeSolver(self._mbs, self._settings):
            raise ParameterError("EXUDYN refuses the robot's numbers; make them less extreme")
        iteration, convergence = solver.it, solver.conv  # copies, to be written back
        iteration.currentStepSize = iteration.recommendedStepSize = self._step
        convergence.jacobianUpdateRequested = True
        solver.it, solver.conv = iteration, convergence
        self._solver = solver

    def advance(self, world: Array, tau_1: float, tau_2: float) -> bool:
        """Advance by a physics step and write coordinates and rates (2, n); False if it cannot."""
        mbs, settings, solver = self._mbs, self._settings, self._solver
        try:
            for share in HALVES:
                self._load(share * tau_1, share * tau_2)
                solver.UpdateCurrentTime(mbs, settings)
                solver.InitializeStep(mbs, settings)
                if not solver.DiscontinuousIteration(mbs, settings):
                    return False
                solver.FinishStep(mbs, settings)
        except self._exu.ExudynError:  # a Jacobian with nan, and the like
            return False
        world[0] = mbs.systemData.GetODE2Coordinates()
        world[1] = mbs.systemData.GetODE2Coordinates_t()
        return True

    def _load(self, tau_1: float, tau_2: float) -> None:
        """Load the angles of link 1 and of the hub with the torques at the joints [N m]."""
        link, hub = self._loads
        self._mbs.SetLoadParameter(link, "load", tau_1 - tau_2)
        self._mbs.SetLoadParameter(hub, "load", tau_2)

    def linearised(self) -> tuple[Array, Array, Array]:
        """Return M, D, K (n, n) of the straight arm at rest, as if nothing held it together."""
        M, K, D = self._mbs.ComputeLinearizedSystem(self._settings)
        return np.array(M), np.array(D), np.array(K)


def axial_stiffness(parameters: Parameters) -> float:
    """Return the EA [N] that the beam is given."""
    return parameters.EI * (SLENDERNESS / parameters.L) ** 2


def _settings(exu: Any, step: float) -> Any:
    """Return how EXUDYN steps: the trapezoidal rule, quiet, no files."""
    s = exu.SimulationSettings()
    s.solution.file.write = s.solution.restart.write = s.solution.sensors.active = False
    s.linearSolver.solverType = exu.LinearSolverType.EXUdense
    rule = s.timeIntegration
    rule.verboseMode = s.staticSolver.verboseMode = 0
    rule.numberOfSteps, rule.startTime, rule.endTime = STEPS_MOST, 0.0, STEPS_MOST * step
    rule.adaptiveStep = rule.automaticStepSize = False
    rule.generalizedAlpha.useNewmark = rule.generalizedAlpha.useIndex2Constraints = True
    rule.generalizedAlpha.computeInitialAccelerations = True
    rule.newton.useModifiedNewton = True
    rule.newton.residualMode = 1  # of increments: forces end in rounding errors of EA
    rule.newton.relativeTolerance = rule.newton.absoluteTolerance = TOLERANCE
    return s


def _assembled(mbs: Any, p: Parameters, elements: int, held: tuple[bool, bool]) -> tuple[Any, Any]:
    """Build the arm in a system; return the loads on the angles of link 1 and of the hub."""
    build = _Build(mbs)
    items, add = build.items, mbs.AddObject
    inertia = p.I_R0 + p.I_m1  # about joint 1, which stays: the mass there does not matter
    link_node, link = build.body(0.0, inertia / p.L_R**2, inertia)
    hub_node, hub = build.body(p.L_R, p.m_H, p.I_H)
    ground = add(items.ObjectGround())
    for one, other in (
        (build.place(ground, 0.0), build.place(link, 0.0)),
        (build.place(link, p.L_R), build.place(hub, 0.0)),
    ):
        add(items.RevoluteJoint2D(markerNumbers=[one, other]))
    length, cables = p.L / elements, build.cables(p, elements)
    build.clamp(build.place(hub, p.r), build.place(cables[0], 0.0))
    if p.payload or p.payload_inertia:
        _, payload = build.body(p.L_R + p.reach, p.payload, p.payload_inertia)
        build.clamp(build.place(cables[-1], length), build.place(payload, 0.0))
    still = build.coordinate(mbs.AddNode(items.NodePointGround()), 0)
    first, second = build.coordinate(link_node, ANGLE), build.coordinate(hub_node, ANGLE)
    joints = ([still, first], p.r_1**2 * p.F_1), ([first, second], p.r_2**2 * p.F_2)
    for (pair, friction), locked in zip(joints, held, strict=True):
        add(items.CoordinateSpringDamper(markerNumbers=pair, damping=friction))
        if locked:  # at whatever angle it is
            add(items.CoordinateConstraint(markerNumbers=pair, velocityLevel=True))
    if p.I_m2:  # it turns with joint 2, whatever link 1 does
        turning = np.zeros((6, 6))
        turning[np.ix_([ANGLE, 3 + ANGLE], [ANGLE, 3 + ANGLE])] = [[p.I_m2, -p.I_m2]] * 2
        turning[3 + ANGLE] *= -1
        add(items.ObjectGenericODE2(nodeNumbers=[link_node, hub_node], massMatrix=turning))
    loads = [mbs.AddLoad(items.LoadCoordinate(markerNumber=each)) for each in (first, second)]
    mbs.Assemble()
    return loads[0], loads[1]


class _Build:
    """The parts that an arm is built of, in EXUDYN's words; every call returns their numbers."""

    def __init__(self, mbs: Any) -> None:
        import exudyn.itemInterface as items

        self.mbs, self.items = mbs, items

    def body(self, x: float, mass: float, inertia: float) -> tuple[Any, Any]:
        """Add a rigid body with its centre at x; return its node and itself."""
        node = self.mbs.AddNode(self.items.NodeRigidBody2D(referenceCoordinates=[x, 0.0, 0.0]))
        rigid = self.items.ObjectRigidBody2D(mass=mass, inertia=inertia, nodeNumber=node)
        return node, self.mbs.AddObject(rigid)

    def cables(self, p: Parameters, elements: int) -> list[Any]:
        """Add the beam; return its elements."""
        items, length = self.items, p.L / elements
        places = [p.L_R + p.r + length * k for k in range(elements + 1)]
        nodes = [
            self.mbs.AddNode(items.NodePoint2DSlope1(referenceCoordinates=[x, 0.0, 1.0, 0.0]))
            for x in places
        ]
        same = {
            "length": length,
            "massPerLength": p.rho,
            "bendingStiffness": p.EI,
            "axialStiffness": axial_stiffness(p),
            "bendingDamping": p.eta * p.EI,
        }
        return [
            self.mbs.AddObject(items.ObjectANCFCable2D(nodeNumbers=nodes[k : k + 2], **same))
            for k in range(elements)
        ]

    def place(self, carrier: Any, x: float) -> Any:
        """Add a marker on a body or element."""
        at = self.items.MarkerBodyRigid(bodyNumber=carrier, localPosition=[x, 0.0, 0.0])
        return self.mbs.AddMarker(at)

    def coordinate(self, node: Any, which: int) -> Any:
        """Add a marker on one of a node's coordinates."""
        at = self.items.MarkerNodeCoordinate(nodeNumber=node, coordinate=which)
        return self.mbs.AddMarker(at)

    def clamp(self, one: Any, other: Any) -> None:
        """Hold two markers together, places and angles about z."""
        axes = [1, 1, 0, 0, 0, 1]
        self.mbs.AddObject(
            self.items.GenericJoint(markerNumbers=[one, other], constrainedAxes=axes)
        )
