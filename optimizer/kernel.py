"""The per-node functions of the programme: built once per robot, compiled, and cached on disk.

`node` gives cost, motor torque and their first and second derivatives at one instant of a motion; everything that a
request may change (payload, gravity, drives, friction, objective) is a parameter. The functions are compiled by the
system's C compiler once and kept under `JOULEPATH_CACHE_DIR` (default `~/.cache/joulepath`), named by a digest of all
that they depend on. Until the compiled file is there, or where there is no compiler, CasADi's virtual machine
evaluates the same expressions.

`python -m optimizer.precompile` compiles the kernels of all robots.
"""

from __future__ import annotations

import fcntl
import hashlib
import logging
import os
import shutil
import subprocess
import tempfile
import threading
from dataclasses import astuple, dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

import models.robot
from models.robot import Array, Drives, FrictionLaw, Robot
from optimizer import dynamics, energy
from optimizer.dynamics import SymbolicPayload, inverse_dynamics
from optimizer.energy import drawn_power, power_flow, smooth_abs

log = logging.getLogger(__name__)

COMPILER_FLAGS = ("-O2", "-fPIC", "-shared", "-fno-math-errno")
# nodes evaluated by one call where the caller's number varies
CHUNK = 64


@dataclass(frozen=True)
class Parameters:
    """What a request may change, in the order in which the compiled functions take it.

    Shapes: com (3,), inertia (6,) ixx ixy ixz iyy iyz izz, gravity (3,), per joint (nq,). `knee` [rad/s] and `width`
    [W] smooth friction's reversal and the cost's corners; `isolated` is 1 where every joint burns its own surplus, else
    0; `electrical`, `mechanical` [1] and `time` [W] weigh the cost.
    """

    mass: Any
    com: Any
    inertia: Any
    gravity: Any
    rotor_inertia: Any
    coulomb: Any
    curved: Any
    speed: Any
    viscous: Any
    torque_constant: Any
    copper: Any
    inverter_constant: Any
    inverter_linear: Any
    inverter_quadratic: Any
    base_power: Any
    regeneration: Any
    isolated: Any
    link_mass_scale: Any
    electrical: Any
    mechanical: Any
    time: Any
    knee: Any
    width: Any

    def pack(self) -> Array:
        """One vector."""
        return np.concatenate([np.atleast_1d(np.asarray(value, dtype=float)) for value in astuple(self)])

    @staticmethod
    def symbols(nq: int) -> tuple[Parameters, ca.SX]:
        """Symbols of the same layout, and their vector."""
        sizes = {"com": 3, "inertia": 6, "gravity": 3}
        scalars = {"mass", "base_power", "regeneration", "isolated"}
        scalars |= {"electrical", "mechanical", "time", "knee", "width"}
        scalars |= {"electrical", "mechanical", "time", "knee", "width"}
        names = Parameters.__dataclass_fields__
        values = {n: ca.SX.sym(n, sizes.get(n, 1 if n in scalars else nq)) for n in names}
        return Parameters(**values), ca.vertcat(*values.values())


def build(robot: Robot) -> list[ca.Function]:
    """The functions of a robot as CasADi expressions.

    `torque`(y, p) → tau: rigid body and rotor torque.
    `value`(y, p) → cost, tau_motor.
    `node`(y, multiplier, weight, p) → cost, tau_motor, gradient of the cost, Jacobian of tau_motor (nq, 3 nq), and the
    Hessian (3 nq, 3 nq) of weight · cost + multiplier · tau_motor. y = (q, v, a) stacked.
    """
    nq = robot.nq
    y = ca.SX.sym("y", 3 * nq)
    q, v, a = y[:nq], y[nq : 2 * nq], y[2 * nq :]
    par, p = Parameters.symbols(nq)
    payload = SymbolicPayload(par.mass, par.com, par.inertia)
    tau = inverse_dynamics(robot.model, q, v, a, payload, par.gravity, par.rotor_inertia, par.link_mass_scale)
    friction = FrictionLaw("symbolic", par.coulomb, par.curved, par.speed, par.viscous, par.knee)
    drives = Drives(
        gear_ratio=None,  # type: ignore[arg-type]
        torque_constant=par.torque_constant,
        rotor_inertia=par.rotor_inertia,
        copper=par.copper,
        inverter_constant=par.inverter_constant,
        inverter_linear=par.inverter_linear,
        inverter_quadratic=par.inverter_quadratic,
    )
    # cost and friction of torque t and speed w, apart from the dynamics that t comes from
    t, w = ca.SX.sym("t", nq), ca.SX.sym("w", nq)
    # the inverter's |i| is rounded off over a tenth of an ampere per watt of width
    flow = power_flow(t, w, drives, friction, 0.1 * par.width, ca)
    shared = drawn_power(par.base_power + ca.sum1(flow.joints), par.regeneration, par.width, ca)
    # six corners in place of one, each rounded off by a sixth
    isolated = par.base_power + ca.sum1(drawn_power(flow.joints, 0, par.width / nq, ca))
    drawn = (1 - par.isolated) * shared + par.isolated * isolated
    mechanical = ca.sum1(smooth_abs(t * w, par.width, ca))
    cost = par.electrical * drawn + par.mechanical * mechanical + par.time
    multiplier, weight = ca.SX.sym("multiplier", nq), ca.SX.sym("weight")
    inner = ca.vertcat(t, w)
    bent, sloped = ca.hessian(cost, inner)
    friction_bent, _ = ca.hessian(ca.dot(multiplier, friction.torque(w, ca)), w)
    local = [cost, flow.tau_motor, sloped, bent, ca.jacobian(friction.torque(w, ca), w), friction_bent]
    cost, tau_motor, sloped, bent, friction_slope, friction_bent = ca.substitute(local, [t, w], [tau, v])

    # the chain rule by hand: a third of the operations that differentiating the composed cost twice would take
    J_tau = ca.jacobian(tau, y)
    J_inner = ca.vertcat(J_tau, ca.horzcat(ca.SX(nq, nq), ca.SX.eye(nq), ca.SX(nq, nq)))
    pull = ca.SX.sym("pull", nq)
    dynamics_bent = ca.substitute(ca.hessian(ca.dot(pull, tau), y)[0], pull, weight * sloped[:nq] + multiplier)
    # half of a symmetric product, mirrored
    hessian = dynamics_bent + ca.tril2symm(ca.tril(J_inner.T @ (weight * bent @ J_inner)))
    hessian[nq : 2 * nq, nq : 2 * nq] += friction_bent
    J_motor = J_tau + 0
    J_motor[:, nq : 2 * nq] += friction_slope
    dense = ca.densify
    return [
        ca.Function("torque", [y, p], [dense(tau)], {"cse": True}),
        ca.Function("value", [y, p], [cost, dense(tau_motor)], {"cse": True}),
        ca.Function(
            "node",
            [y, multiplier, weight, p],
            [cost, dense(tau_motor), dense(J_inner.T @ sloped), dense(J_motor), dense(hessian)],
            {"cse": True},
        ),
    ]


FUNCTION_NAMES = ("torque", "value", "node")


def cache_directory() -> Path:
    """Where compiled kernels are kept."""
    given = os.environ.get("JOULEPATH_CACHE_DIR")
    return Path(given) if given else Path.home() / ".cache" / "joulepath"


def digest(robot: Robot) -> str:
    """Hash of everything that the compiled functions depend on: the chain, the sources, versions, compiler flags."""
    h = hashlib.sha256()
    for module in (models.robot, dynamics, energy):
        h.update(Path(str(module.__file__)).read_bytes())
    h.update(Path(__file__).read_bytes())
    h.update(repr((version("casadi"), COMPILER_FLAGS, os.uname().machine)).encode())
    flange = robot.model.frames[robot.model.getFrameId("flange")].placement
    figures = [placement.homogeneous for placement in [*robot.model.jointPlacements, flange]]
    figures += [body.toDynamicParameters() for body in robot.model.inertias]
    for figure in figures:
        # rounded, since the last digit of a sine differs between processors; + 0.0 makes -0.0 and 0.0 one
        h.update((np.round(figure, 12) + 0.0).tobytes())
    return h.hexdigest()[:24]


def _library(robot: Robot) -> Path:
    return cache_directory() / f"{robot.name}-{digest(robot)}.so"


def _seal(path: Path) -> Path:
    """File that holds the library's own hash, so that a damaged library is noticed before it is loaded."""
    return path.with_suffix(".sha256")


def _intact(path: Path) -> bool:
    try:
        return _seal(path).read_bytes() == hashlib.sha256(path.read_bytes()).hexdigest().encode()
    except OSError:
        return False


def compiler() -> str | None:
    """The system's C compiler, or None."""
    return shutil.which(os.environ.get("CC", "cc")) or shutil.which("gcc") or shutil.which("clang")


def compile_kernel(robot: Robot) -> Path:
    """Compile a robot's functions into the cache, once however many processes ask; returns the library.

    Raises RuntimeError where there is no compiler or it fails, OSError where the cache cannot be written.
    """
    target = _library(robot)
    target.parent.mkdir(parents=True, exist_ok=True)
    with (target.with_suffix(".lock")).open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if _intact(target):
            return target
        command = compiler()
        if command is None:
            raise RuntimeError("no C compiler found")
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            generator = ca.CodeGenerator("kernel.c", {"with_header": False})
            for function in build(robot):
                generator.add(function)
            generator.generate(folder + "/")
            library = Path(folder) / "kernel.so"
            source = str(Path(folder) / "kernel.c")
            run = subprocess.run(
                [command, *COMPILER_FLAGS, source, "-o", str(library), "-lm"], capture_output=True, text=True
            )
            if run.returncode:
                raise RuntimeError(f"the C compiler failed: {run.stderr[-500:]}")
            seal = Path(folder) / "kernel.sha256"
            seal.write_text(hashlib.sha256(library.read_bytes()).hexdigest())
            # the seal first: a library without its seal counts as damaged, a seal without its library as absent
            seal.replace(_seal(target))
            library.replace(target)
    return target


class _Mapped:
    """A function mapped over a fixed number of nodes, called on numpy buffers without copies or conversions."""

    def __init__(self, function: ca.Function, count: int) -> None:
        self._function = function.map(count)
        self._buffer, self._run = self._function.buffer()
        self.arguments = [np.zeros(self._function.size_in(i)[::-1]) for i in range(self._function.n_in())]
        self.results = [np.zeros(self._function.size_out(i)[::-1]) for i in range(self._function.n_out())]
        for i, array in enumerate(self.arguments):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore[call-arg, arg-type]
        for i, array in enumerate(self.results):
            self._buffer.set_res(i, memoryview(array))  # type: ignore[call-arg, arg-type]

    def __call__(self, *arguments: Array) -> list[Array]:
        """Evaluate; row k of every argument belongs to node k. The results are overwritten by the next call."""
        for own, given in zip(self.arguments, arguments, strict=True):
            own[...] = given
        self._run()
        return self.results


class Kernel:
    """A robot's functions, ready to be called on arrays of nodes. Not for several threads at once."""

    def __init__(self, robot: Robot, functions: list[ca.Function], compiled: bool) -> None:
        self.nq = robot.nq
        self.compiled = compiled
        self._functions = dict(zip(FUNCTION_NAMES, functions, strict=True))
        self._mapped: dict[tuple[str, int], _Mapped] = {}

    def _map(self, name: str, count: int) -> _Mapped:
        key = (name, count)
        if key not in self._mapped:
            self._mapped[key] = _Mapped(self._functions[name], count)
        return self._mapped[key]

    def node(self, y: Array, multiplier: Array, weight: Array, p: Array) -> tuple[Array, ...]:
        """Cost (N,), tau_motor (N, nq), gradient (N, 3nq), Jacobian (N, nq, 3nq), Hessian (N, 3nq, 3nq).

        y (N, 3nq), multiplier (N, nq), weight (N,), p packed `Parameters`. Views that the next call overwrites.
        """
        count, nq = len(y), self.nq
        cost, tau, gradient, jacobian, hessian = self._map("node", count)(y, multiplier, weight[:, None], p)
        return (
            cost[:, 0],
            tau,
            gradient,
            jacobian.reshape(count, 3 * nq, nq).transpose(0, 2, 1),
            hessian.reshape(count, 3 * nq, 3 * nq),
        )

    def value(self, y: Array, p: Array) -> tuple[Array, Array]:
        """Cost (N,) and tau_motor (N, nq). Views that the next call overwrites."""
        cost, tau = self._map("value", len(y))(y, p)
        return cost[:, 0], tau

    def torque(self, q: Array, v: Array, a: Array, p: Array) -> Array:
        """Rigid body and rotor torque tau (k, nq) for any number of samples."""
        count = len(q)
        mapped = self._map("torque", CHUNK)
        y = np.zeros((-(-count // CHUNK) * CHUNK, 3 * self.nq))
        y[:count] = np.hstack([q, v, a])
        return np.concatenate([mapped(y[i : i + CHUNK], p)[0].copy() for i in range(0, len(y), CHUNK)])[:count]


class _Loader:
    """Holds a robot's kernel and swaps the compiled one in when it is there."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._library = _library(robot)
        self._kernel: Kernel | None = None
        self._compiling: threading.Thread | None = None

    def get(self) -> Kernel:
        if self._kernel is not None and (self._kernel.compiled or not _seal(self._library).exists()):
            return self._kernel
        if _intact(self._library):
            functions = [ca.external(name, str(self._library)) for name in FUNCTION_NAMES]
            self._kernel = Kernel(self._robot, functions, compiled=True)
        elif self._kernel is None:
            self._kernel = Kernel(self._robot, build(self._robot), compiled=False)
        if not self._kernel.compiled and self._compiling is None and compiler() is not None:
            self._compiling = threading.Thread(target=self._compile, name="kernel-compiler", daemon=True)
            self._compiling.start()
        return self._kernel

    def _compile(self) -> None:
        try:
            compile_kernel(self._robot)
        except (RuntimeError, OSError) as error:
            log.warning("kernel of %s not compiled, the virtual machine serves: %s", self._robot.name, error)


@cache
def _loader(robot: Robot) -> _Loader:
    return _Loader(robot)


def kernel_for(robot: Robot) -> Kernel:
    """The kernel of a robot: compiled if the cache has it, else interpreted while the compiler runs."""
    return _loader(robot).get()
