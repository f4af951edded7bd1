"""Options of exports: a wrong one is refused on construction, before it reaches a controller."""

import numpy as np
import pytest

from joulepath import (
    FrankaOptions,
    InvalidProblem,
    KrlOptions,
    LimitsOptions,
    McapOptions,
    MoveitOptions,
    RapidOptions,
    Ros2Options,
    TableOptions,
    UrscriptOptions,
)


@pytest.mark.parametrize(
    ("options", "field", "wrong"),
    [
        (TableOptions, "period", (0.0, -1.0, np.nan, "1", None)),
        (McapOptions, "period", (0.0,)),
        (McapOptions, "prefix", ("a b", "line\n", None, "x" * 65)),
        (LimitsOptions, "prefix", ("'",)),
        (UrscriptOptions, "rate", (250, "500")),
        (UrscriptOptions, "form", ("splines",)),
        (UrscriptOptions, "gain", (np.nan, -1.0, 1e9)),
        (UrscriptOptions, "lookahead_time", (0.0, np.inf)),
        (UrscriptOptions, "digital_output", (-1, 8, "a")),
        (FrankaOptions, "form", ("c",)),
        (MoveitOptions, "encoding", ("xml",)),
        (Ros2Options, "message", ("action",)),
        (Ros2Options, "controller", ("", "a b", "/")),
        (KrlOptions, "tolerance", (0.0, np.nan)),
        (KrlOptions, "signs", ((0,) * 6, (2,) * 6, 1, "1")),
        (KrlOptions, "offsets", ((np.nan,) * 6, 90.0, np.nan)),
        (KrlOptions, "digital_output", (0, 5000)),
        (RapidOptions, "digital_output", ("do 1", "1do", "do\n", "do1;Stop")),
    ],
)
def test_a_wrong_option_is_refused(options, field, wrong):
    for value in wrong:
        with pytest.raises(InvalidProblem, match=rf"^{field}(\.0)? must") as caught:
            options(**{field: value})
        assert caught.value.field in (field, f"{field}.0")
