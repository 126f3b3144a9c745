"""The stated types are those of the code."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("mypy")


def checked(folder, *arguments):
    # Elsewhere than in the package, whose modules would hide those of Python.
    return subprocess.run([sys.executable, "-m", *arguments], cwd=folder, env={**os.environ, "MYPY_CACHE_DIR": str(folder)}, capture_output=True, text=True)


def test_the_package_is_typed(tmp_path):
    done = checked(tmp_path, "mypy", "--strict", "--no-warn-return-any", "--ignore-missing-imports", "-p", "fieldgap")
    assert done.returncode == 0, done.stdout


def test_the_stubs_are_those_of_the_native_module(tmp_path):
    allowed = tmp_path / "allowed"
    allowed.write_text("fieldgap._native.__all__\n")
    done = checked(tmp_path, "mypy.stubtest", "--ignore-disjoint-bases", "--allowlist", allowed, "fieldgap._native")
    assert done.returncode == 0, done.stdout
