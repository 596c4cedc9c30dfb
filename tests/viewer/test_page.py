"""The page in headless Chromium: it shows the laboratory, and a person drives a meter."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from headless_browser import browser, chromium
from PIL import Image

from labgym.eval.driving.files import read_rows
from runs.killing import hear_interrupts

SPEED = (
    "document.getElementById('speed').value = '8'; document.getElementById('speed').dispatchEvent(new Event('change'))"
)


@pytest.mark.skipif(chromium() is None, reason="needs Chromium (Debian: apt install chromium)")
def test_a_person_drives_a_meter_on_the_page_and_ctrl_c_leaves_nothing(layout, suite, tmp_path: Path) -> None:
    path, rules = layout.save(tmp_path / "lab.json"), suite.save(tmp_path / "suite.json")
    command = [sys.executable, "-m", "labgym.cli", "play", str(path), "--suite", str(rules), "--port", "0"]
    command += ["--out", str(tmp_path / "me")]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment, preexec_fn=hear_interrupts)
    try:
        url = process.stdout.readline().split()[1]
        with browser(tmp_path / "profile") as tab:
            tab.open(url, 480, 320)
            tab.wait("document.body.dataset.scene === 'ready' && document.body.dataset.phase === 'ready'")
            assert tab.value("Number(document.body.dataset.meshes)") > 10
            picture = np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"))
            assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 1000
            tab.value(SPEED)
            tab.key("ArrowDown", down=True)
            tab.wait("Number(document.body.dataset.driven) > 1")
            tab.key("ArrowDown", down=False)
            tab.wait("document.body.dataset.phase === 'finished'")
            assert tab.errors == []
    finally:
        process.send_signal(signal.SIGINT)
        rest, _ = process.communicate(timeout=300)
    assert process.returncode == 0
    (row,) = read_rows(tmp_path / "me" / "episodes.jsonl")
    assert row.policy == "person"
    assert row.path_length > 1.0
    assert f"{row.contacts} contacts" in rest
