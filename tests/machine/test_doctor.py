"""The report names each thing, its state, and the remedy where it is not well."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.machine import doctor, vulkan_driver
from tests.checked_shapes import VARIABLE


def test_what_is_there_is_well() -> None:
    assert doctor.check_python().remedy == ""
    assert str(sys.version_info.minor) in doctor.check_python().state


def test_a_missing_compiler_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    finding = doctor.check_tools()
    assert "make" in finding.state
    assert "cc" in finding.state
    assert "build-essential" in finding.remedy


def test_a_package_off_its_pin_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / ".venv").mkdir()
    (tmp_path / ".venv/.ready").touch()
    (tmp_path / "constraints.txt").write_text("numpy==0.0.1\nno-such-package==1.0\n")
    monkeypatch.setattr(doctor, "ROOT", tmp_path)
    finding = doctor.check_venv()
    assert "numpy 0.0.1 (there is" in finding.state
    assert "no-such-package 1.0 (there is none)" in finding.state
    assert "make setup" in finding.remedy


def test_no_driver_means_the_command_that_installs_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(vulkan_driver, "has_gpu", lambda: False)
    monkeypatch.setattr(vulkan_driver, "is_ready", lambda: False)
    monkeypatch.setattr(vulkan_driver, "software_icd", lambda: None)
    finding = doctor.check_driver()
    assert "Embree" in finding.state
    assert "apt-get install" in finding.remedy


def test_the_report_fails_when_something_needs_care(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ill = doctor.Finding("room", "no disk", "free some")
    monkeypatch.setattr(doctor, "CHECKS", (lambda: doctor.Finding("a", "fine"), lambda: ill))
    assert doctor.main() == 1
    assert "to mend it: free some" in capsys.readouterr().out
    monkeypatch.setattr(doctor, "CHECKS", (lambda: doctor.Finding("a", "fine"),))
    assert doctor.main() == 0


def test_it_runs_before_anything_is_installed() -> None:
    """`make doctor` may come first, with the system's Python and no package."""
    bare = subprocess.run(
        [
            *(sys.executable, "-S", "-c"),
            f"import sys; sys.path.insert(0, {str(doctor.ROOT)!r}); import pipeline.machine.doctor",
        ],
        env={name: value for name, value in os.environ.items() if name != VARIABLE},
        capture_output=True,
        text=True,
        check=False,
    )
    assert bare.returncode == 0, bare.stderr


def test_the_printed_command_writes_the_source_that_installing_writes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = "Types: deb\nURIs: http://deb.debian.org/debian\nSuites: bookworm-backports\n"
    monkeypatch.setattr(vulkan_driver, "backports_source", lambda: source)
    first = vulkan_driver.advice().splitlines()[0].strip()
    written, _, _ = first.partition(" | ")
    said = subprocess.run(["/bin/sh", "-c", written], capture_output=True, text=True, check=True)
    assert said.stdout == source


def test_without_a_cluster_none_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    assert doctor.check_cluster().remedy == ""


def test_what_a_cluster_lacks_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program = (
        "import sys; print('cluster: 1 of 2 nodes can'); print('  b: other files'); sys.exit(1)"
    )
    (tmp_path / "looked.py").write_text(program)
    monkeypatch.setenv("RAY_ADDRESS", "10.0.0.1:6379")
    monkeypatch.setattr(doctor, "ROOT", tmp_path)
    monkeypatch.setattr(doctor, "CLUSTER", "looked")
    finding = doctor.check_cluster()
    assert finding.state.splitlines() == ["1 of 2 nodes can", "  b: other files"]
    assert "this driver" in finding.remedy


def test_the_store_is_looked_at_where_one_is_named(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(doctor, "ROOT", tmp_path)
    monkeypatch.delenv("RUN_STORE", raising=False)
    monkeypatch.setenv("RUN", "mine")
    assert doctor.check_store() == doctor.Finding("store", "none: runs lie in their folders")
    (tmp_path / "runs/mine").mkdir(parents=True)
    (tmp_path / "runs/mine/run.toml").write_text('[store]\nurl = "s3://bucket/prefix"\n')
    (tmp_path / "stages").mkdir()
    (tmp_path / "stages/__init__.py").touch()
    for text, remedy in (("print('store: fine')", ""), ("raise SystemExit('full')", "do as")):
        (tmp_path / "stages/store.py").write_text(text)
        finding = doctor.check_store()
        assert finding.state == ("full" if remedy else "fine")
        assert finding.remedy.startswith(remedy)
        assert bool(finding.remedy) == bool(remedy)
