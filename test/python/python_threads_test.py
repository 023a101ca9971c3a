"""Long calls: other threads run, Ctrl-C stops calls, and Python may exit during them."""

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import groundray
import numpy as np
import pytest
import small_scene

# In a folder `folder`: a camera whose images take time by `samples`, without more memory.
BEGIN = """\
import pathlib, sys, threading, time
import groundray, numpy as np, small_scene

folder = pathlib.Path(sys.argv[1])
spec = small_scene.spec(folder, camera=True)
text = (folder / "eye.yaml").read_text()
terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)

def camera_of(samples):
    eye = text.replace("samples: 4", f"samples: {samples}")
    eye = eye.replace("[48, 36]", "[48, 960]").replace("[radiance, ", "[radiance]  # ")
    (folder / "eye.yaml").write_text(eye)
    return groundray.scene(spec, folder=folder, terrain=terrain).camera("eye")

def taken_s(samples):
    camera = camera_of(samples)
    begin = time.monotonic()
    camera.expose(frame=0)
    return time.monotonic() - begin

def lasting(least_s):
    # A camera whose images take about so long by what shorter ones took, and how long that is.
    samples = 1
    while (spent_s := taken_s(samples)) < 0.2:
        samples *= 2
    more = 1 << int(np.ceil(np.log2(max(1, least_s / spent_s))))
    return camera_of(samples * more), spent_s * more
"""


def python(folder, script, **options):
    """Starts a separate Python with the script."""
    (folder / "script.py").write_text(script)
    path = f"{small_scene.PACKAGE}:{Path(small_scene.__file__).parent}"
    return subprocess.Popen(
        [sys.executable, folder / "script.py", folder],
        stdout=subprocess.PIPE,
        text=True,
        env={"PYTHONPATH": path},
        **options,
    )


def ticks_during(call):
    """Returns the time of a call, and how often another thread ran during it."""
    seen, is_done = [], threading.Event()

    def tick():
        while not is_done.is_set():
            seen.append(time.monotonic())
            time.sleep(0.002)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    call()
    end = time.monotonic()
    is_done.set()
    thread.join()
    # At the call's ends it may hold the GIL, to take arrays and give them.
    spent_s = end - begin
    return spent_s, sum(begin + spent_s / 4 < at < end - spent_s / 4 for at in seen)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A terrain, and a camera of a scene on it."""
    folder = tmp_path_factory.mktemp("python_threads")
    terrain = groundray.Terrain(small_scene.heights_m(), small_scene.CELL_M)
    spec = small_scene.spec(folder, camera=True)
    return terrain, groundray.scene(spec, folder=folder, terrain=terrain).camera("eye")


def cast(made, count):
    rays = np.random.default_rng(3).normal(size=(count, 3))
    return lambda: made[0].cast_rays(np.full((count, 3), [30.0, 30.0, 20.0]), rays)


def heights(made, count):
    places = np.random.default_rng(3).uniform(0, 70, (count, 2))
    return lambda: made[0].heights_at(places)


def project(made, count):
    points_m = np.random.default_rng(3).uniform(1, 2, (count, 3))
    return lambda: made[1].project(points_m)


def mesh(made, count):
    vertices_m = np.random.default_rng(3).normal(size=(count, 3))
    triangles = np.arange(count - count % 3).reshape(-1, 3)
    return lambda: groundray.Mesh(vertices_m, triangles)


def terrain(made, count):
    side = int(np.sqrt(count))
    heights_m = np.zeros((side, side), np.float32)
    return lambda: groundray.Terrain(heights_m)


@pytest.mark.parametrize("work", [cast, heights, project, mesh, terrain])
def test_other_threads_run_during_a_long_call(made, work):
    spent_s, ticks, count = 0, 0, 1 << 15
    while (spent_s < 0.2 or ticks == 0) and count < 1 << 24:  # the work that shows it here
        count *= 2
        spent_s, ticks = ticks_during(work(made, count))
    assert ticks > 0, (count, spent_s)  # of a hundred; with the GIL held there is none


def test_ctrl_c_ends_a_long_call(tmp_path):
    script = BEGIN + (
        "camera, whole_s = lasting(120)\n"
        "try:\n"
        "    print(whole_s, flush=True)\n"  # within: a signal may come before the next line
        "    camera.expose(frame=0)\n"
        "except KeyboardInterrupt:\n"
        "    print('interrupted')\n"
    )
    # Jobs in the background of a shell script ignore Ctrl-C, and so would this process.
    heed = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}
    with python(tmp_path, script, **heed) as process:
        whole_s = float(process.stdout.readline())
        time.sleep(0.5)
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert (process.stdout.read(), process.wait()) == ("interrupted\n", 0)
        assert time.monotonic() - begin < whole_s / 2


@pytest.mark.parametrize("delay_s", [0, 0.1, 0.3])
@pytest.mark.parametrize(
    "call",
    [
        "camera.expose(frame=0)",
        "terrain.cast_rays(origins, directions)",
        "terrain.heights_at(places)",
        "groundray.load_terrain(folder / 'absent.tif')",
    ],
)
def test_python_may_exit_during_calls_of_daemon_threads(tmp_path, call, delay_s):
    # Nothing asks them to stop: those who are in the call are to be left where they are.
    script = BEGIN + (
        "camera, _ = lasting(0.5)\n"
        "origins = np.full((300_000, 3), [30.0, 30.0, 20.0])\n"
        "directions = np.random.default_rng(3).normal(size=origins.shape)\n"
        "places = np.random.default_rng(3).uniform(0, 70, (1_000_000, 2))\n"
        "def again():\n"
        "    while True:\n"
        "        try:\n"
        f"            {call}\n"
        "        except groundray.Error:\n"
        "            pass\n"
        "for _ in range(4):\n"
        "    threading.Thread(target=again, daemon=True).start()\n"
        f"time.sleep(0.2 + {delay_s})\n"
        "print('the end', flush=True)\n"
    )
    with python(tmp_path, script, stderr=subprocess.PIPE) as process:
        out, err = process.communicate(timeout=300)
    assert (process.returncode, out) == (0, "the end\n"), err
    assert "terminate" not in err
