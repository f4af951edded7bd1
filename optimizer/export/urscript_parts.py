"""Functions at the head of a URScript program."""

from __future__ import annotations

JOINTS = 6

CHECKS = """\
  global jp_tick = 1
  def jp_stop(message):
    stopj(2.0)
    popup(message, "joulepath", False, True, blocking=True)
    halt
  end
  # largest distance of a joint between two positions
  def jp_far(q, p):
    local far = 0.0
    local apart = 0.0
    local joint = 0
    while joint < 6:
      apart = norm(q[joint] - p[joint])
      if apart > far:
        far = apart
      end
      joint = joint + 1
    end
    return far
  end
  def jp_payload(mass, cog):
    set_payload(mass, cog)
    sleep(0.1)
    if norm(get_target_payload() - mass) > 0.01:
      jp_stop("The controller did not take the payload of the motion.")
    end
  end""".splitlines()
"""Functions that stop, measure distances between joint positions, and set the payload; `jp_tick`
counts the periods of a move, so that rounding errors do not add up."""


def serving(
    rate: int, lookahead_time: float, gain: float, tracking: float, degree: int
) -> list[str]:
    """Functions that send set points to servoj.

    Args:
        rate: rate of the set points [Hz].
        lookahead_time: parameter of servoj [s].
        gain: parameter of servoj.
        tracking: largest distance from a set point [rad].
        degree: degree of all polynomials.
    """
    powers = [_horner(joint, degree) for joint in range(JOINTS)]
    return f"""\
  def jp_servo(q):
    servoj(q, t={1 / rate:g}, lookahead_time={lookahead_time:g}, gain={gain:g})
    if jp_far(get_actual_joint_positions(), q) > {tracking:.4f}:
      jp_stop("The arm does not follow the motion.")
    end
  end
  # position at the share u of a piece with the coefficients c
  def jp_at(c, u):
    return [{", ".join(powers)}]
  end
  # the part of a move from begin to end
  def jp_piece(begin, until, c):
    while jp_tick * {1 / rate:g} < until:
      jp_servo(jp_at(c, (jp_tick * {1 / rate:g} - begin) / (until - begin)))
      jp_tick = jp_tick + 1
    end
  end
  # the end of a move: the last set point holds until the arm stands there
  def jp_arrive(goal):
    local left = {rate}
    while left > 0:
      jp_servo(goal)
      left = left - 1
      if jp_far(get_actual_joint_positions(), goal) < 0.001:
        left = 0
      end
    end
    stopj(2.0)
    if jp_far(get_actual_joint_positions(), goal) > 0.01:
      jp_stop("The arm did not reach the end of the motion.")
    end
  end""".splitlines()


def _horner(joint: int, degree: int) -> str:
    """Polynomial of a joint in Horner's form, with coefficients c[k * JOINTS + joint] of u to the
    power k."""
    text = f"c[{degree * JOINTS + joint}]"
    for power in range(degree - 1, -1, -1):
        inner = text if power == degree - 1 else f"({text})"
        text = f"{inner} * u + c[{power * JOINTS + joint}]"
    return text
