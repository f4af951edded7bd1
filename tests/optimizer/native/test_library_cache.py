"""Where compiled libraries are kept, and which of them leave."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from optimizer.native import library_cache
from optimizer.native.library_cache import cache_directory, mark_used


def test_the_cache_is_where_the_user_says_or_at_home(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("JOULEPATH_CACHE_DIR", str(tmp_path))
    assert cache_directory() == tmp_path
    monkeypatch.delenv("JOULEPATH_CACHE_DIR")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_directory() == tmp_path / "home" / ".cache" / "joulepath"


def test_libraries_that_rested_longest_leave(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many arms that users bring; a library in use is marked, and stays."""
    monkeypatch.setattr(library_cache, "MOST_LIBRARIES", 3)
    for k in range(5):
        for ending in (".so", ".sha256", ".lock"):
            (tmp_path / f"arm{k}{ending}").write_bytes(b"?")
        os.utime(tmp_path / f"arm{k}.so", (k, k))
    mark_used(tmp_path / "arm0.so")
    library_cache._prune(tmp_path)
    assert sorted(path.name for path in tmp_path.glob("*.so")) == ["arm0.so", "arm3.so", "arm4.so"]
    assert len(list(tmp_path.iterdir())) == 9
    # a folder that is gone is no error
    mark_used(tmp_path / "none" / "arm.so")
    library_cache._prune(tmp_path / "none")
