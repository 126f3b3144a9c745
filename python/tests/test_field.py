"""The field, beside sums that NumPy computes by the closed forms."""

import multiprocessing
import subprocess
import sys
import textwrap
import threading
import time

import numpy as np
import pytest

import fieldgap as fg

C = 343.0
K = 2 * np.pi * 40e3 / C
MEDIUM = fg.Medium(speed_of_sound=C)


def bessel_j1(x):
    """J1 by Bessel's integral; the trapezoidal rule is exact to rounding for a periodic function."""
    tau = (np.arange(64) + 0.5) * np.pi / 64
    return np.cos(tau - np.asarray(x)[..., np.newaxis] * np.sin(tau)).mean(axis=-1)


def summed(array, points, drive, directivity):
    """The sum over elements, by its formula."""
    field = np.zeros(points.shape[:-1], dtype=complex)
    for centre, normal, weight in zip(array.positions, array.normals, drive):
        ray = points - centre
        distance = np.linalg.norm(ray, axis=-1)
        cosine = ray @ normal / distance
        level = np.where(cosine > 0, directivity(np.sqrt(np.maximum(0.0, 1 - cosine**2))), 0.0)
        field += weight * level / distance * np.exp(1j * K * distance)
    return field


def piston(sine):
    x = np.maximum(K * 4.5e-3 * sine, 1e-9)
    return 2 * bessel_j1(x) / x


def focused(array, focus):
    distance = np.linalg.norm(array.positions - np.asarray(focus), axis=1)
    return np.exp(1j * K * (distance.max() - distance))


def off(field, expected):
    return np.abs(field - expected).max() / np.abs(expected).max()


RANDOM = np.random.default_rng(7)
CLOUD = RANDOM.uniform([-0.05, -0.05, 0.02], [0.05, 0.05, 0.2], size=(40, 25, 3))


@pytest.mark.parametrize("method", ["auto", "direct"])
@pytest.mark.parametrize("model, directivity", [("monopole", np.ones_like), ("piston", piston)])
def test_a_focused_array_has_the_field_of_its_closed_form(model, directivity, method):
    array = fg.Array.square(6, 6, pitch=10.5e-3)
    focus = (0.01, -0.005, 0.15)
    for points in (CLOUD, fg.plane(0.15, size=0.08, step=1e-3), fg.plane(0.06, size=0.08, step=1e-3).transpose(1, 0, 2)):
        field = fg.simulate(array, points, focus=focus, medium=MEDIUM, transducer=model, method=method)
        assert field.shape == points.shape[:-1] and field.dtype == np.complex128
        assert off(field, summed(array, points, focused(array, focus), directivity)) < 1e-8


def test_volumes_and_grids_in_either_order_are_the_direct_sum():
    array = fg.Array.hexagonal(6, pitch=10.5e-3)
    x, y, z = np.linspace(-0.04, 0.04, 81), np.linspace(-0.03, 0.05, 77), np.array([0.05, 0.1, 0.15])
    of_xy = np.stack(np.meshgrid(z, x, y, indexing="ij"), axis=-1)[..., [1, 2, 0]]
    of_yx = of_xy.transpose(0, 2, 1, 3)
    for points in (of_xy, of_yx):
        auto, direct = (fg.simulate(array, points, focus=(0, 0, 0.1), method=method) for method in ("auto", "direct"))
        assert off(auto, direct) < 1e-8
        assert not np.array_equal(auto, direct), "the structure of the planes was used"


def test_tilted_elements_and_a_complex_drive_have_the_field_of_their_closed_form():
    positions = RANDOM.uniform(-0.04, 0.04, size=(20, 3)) * [1, 1, 0.1]
    normals = RANDOM.normal(size=(20, 3)) * [0.3, 0.3, 0.0] + [0, 0, 2.0]
    array = fg.Array.from_positions(positions, normals)
    assert np.allclose(np.linalg.norm(array.normals, axis=1), 1.0)
    drive = RANDOM.normal(size=20) + 1j * RANDOM.normal(size=20)
    points = CLOUD + [0, 0, 0.02]
    field = fg.simulate(array, points, drive=drive, medium=MEDIUM)
    assert off(field, summed(array, points, drive, piston)) < 1e-8


def test_own_amplitudes_and_phases_of_elements_count_as_a_drive_does():
    array = fg.Array.square(3, 2, pitch=10e-3)
    drive = np.array([1, 2j, 0.5, -1, 0, 1 + 1j])
    own = fg.Array.from_positions(array.positions, amplitudes=np.abs(drive), phases=np.angle(drive))
    assert np.allclose(own.amplitudes, np.abs(drive)) and np.allclose(own.phases, np.angle(drive))
    assert off(fg.simulate(own, CLOUD), fg.simulate(array, CLOUD, drive=drive)) < 1e-12


def test_pressures_are_in_pascals_for_a_drive_in_pascals_at_one_metre():
    one = fg.Array.from_positions([[0, 0, 0]])
    assert np.abs(fg.simulate(one, [0.0, 0.0, 2.0], drive=[3.0])) == pytest.approx(1.5)


def test_attenuation_weakens_by_nepers():
    one = fg.Array.from_positions([[0, 0, 0]])
    air = fg.Medium(temperature_c=20, humidity=0.5, pressure=101325)
    clear, weakened = (fg.simulate(one, [0, 0, 0.7], medium=air, attenuation=a) for a in (0.0, air.attenuation(40e3)))
    # ISO 9613-1 has 1.3 dB/m at 40 kHz, 20 degrees and 50 %.
    assert air.attenuation(40e3) == pytest.approx(1.3 / 8.686, rel=0.05)
    assert np.abs(weakened / clear) == pytest.approx(np.exp(-0.7 * air.attenuation(40e3)))


def test_models_by_name_and_by_object_agree():
    array = fg.Array.square(4, 4, pitch=10.5e-3)
    for name, own in [
        ("piston", fg.Transducer.piston()),
        ("monopole", fg.Transducer.monopole()),
        ("multi-gaussian", fg.Transducer.multi_gaussian()),
        ("rayleigh", fg.Transducer.rayleigh()),
        ("gaussian", fg.Transducer.gaussian(0.538704)),
    ]:
        named, by_object = (fg.simulate(array, CLOUD, transducer=model) for model in (name, own))
        assert off(named, by_object) < 1e-6, name


def test_a_measured_table_of_a_piston_is_nearly_a_piston():
    array = fg.Array.square(4, 4, pitch=10.5e-3)
    angles = np.linspace(0, np.pi / 2, 91)
    table = fg.Transducer.table(angles, piston(np.sin(angles)))
    assert off(fg.simulate(array, CLOUD, transducer=table, medium=MEDIUM), fg.simulate(array, CLOUD, medium=MEDIUM)) < 1e-3


def test_the_number_of_threads_does_not_change_the_field():
    array = fg.Array.square(6, 6, pitch=10.5e-3)
    fields = [fg.simulate(array, CLOUD, focus=(0, 0, 0.1), threads=threads) for threads in (None, 1, 2, 3)]
    assert all(np.array_equal(fields[0], other) for other in fields[1:])


def test_points_of_any_layout_are_read():
    array = fg.Array.square(6, 6, pitch=10.5e-3)
    expected = fg.simulate(array, CLOUD)
    backwards = CLOUD[::-1, :, :]
    assert np.array_equal(fg.simulate(array, np.asfortranarray(CLOUD)), expected)
    assert off(fg.simulate(array, backwards)[::-1], expected) < 1e-12
    single = fg.simulate(array, CLOUD.astype(np.float32))
    assert off(single, expected) < 1e-3
    assert fg.simulate(array, np.empty((0, 3))).shape == (0,)
    assert fg.simulate(array, CLOUD[0, 0].tolist()).shape == ()
    read_only = CLOUD.copy()
    read_only.flags.writeable = False
    assert np.array_equal(fg.simulate(array, read_only), expected)


def test_no_copy_is_made_of_a_large_array_of_points():
    # Beside the points and the field, blocks of two megabytes are needed: the peak of memory shows a copy of 240 MB.
    script = """
        import resource, numpy as np, fieldgap as fg
        array = fg.Array.square(2, 1, pitch=1e-2)
        points = np.full((10_000_000, 3), 0.1)
        fg.simulate(array, points[:100_000])
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        field = fg.simulate(array, points)
        print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 - field.nbytes)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 60e6


def test_another_thread_proceeds_meanwhile():
    array = fg.Array.square(30, 30, pitch=10.5e-3)
    points = RANDOM.uniform([-0.05, -0.05, 0.02], [0.05, 0.05, 0.2], size=(200_000, 3))
    fg.simulate(array, points[:1000], threads=1)
    spans, done = [], threading.Event()

    def work():
        start = time.perf_counter()
        fg.simulate(array, points, threads=1)
        spans.append((start, time.perf_counter()))
        done.set()

    thread = threading.Thread(target=work)
    ticks = []
    thread.start()
    while not done.is_set():
        ticks.append(time.perf_counter())
        done.wait(1e-3)
    thread.join()
    (start, end), = spans
    inside = np.array([tick for tick in ticks if start < tick < end])
    # The sum takes a few blocks of a tenth of a second; with the lock held there would be no tick within a block.
    assert end - start > 0.1 and len(inside) > 20, (end - start, len(inside))


def test_a_forked_process_computes_too():
    array = fg.Array.square(6, 6, pitch=10.5e-3)
    expected = fg.simulate(array, CLOUD, focus=(0, 0, 0.1))
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=lambda: queue.put(fg.simulate(array, CLOUD, focus=(0, 0, 0.1))))
    child.start()
    assert np.array_equal(queue.get(timeout=60), expected)
    child.join(60)
    assert child.exitcode == 0


# Within this a call ends that would take a minute and more: a busy machine is slow, too.
SOON_S = 20.0


def interrupted(setup, call):
    """Seconds from Ctrl-C to the end of a long call."""
    script = f"""
import os, signal, threading, time
import numpy as np, fieldgap as fg
# A program that was started in the background ignores Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
{setup}
pressed = []
def press():
    pressed.append(time.perf_counter())
    os.kill(os.getpid(), signal.SIGINT)
threading.Timer(0.5, press).start()
try:
    {call}
    print("ended by itself")
except KeyboardInterrupt:
    print(time.perf_counter() - pressed[0])
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=120)
    return float(done.stdout)


def test_ctrl_c_ends_a_long_sum():
    setup = "array = fg.Array.square(90, 90, pitch=5e-3); points = np.random.default_rng(1).uniform(0.02, 0.2, size=(20_000_000, 3))"
    assert interrupted(setup, "fg.simulate(array, points)") < SOON_S


def test_ctrl_c_ends_a_long_plane():
    setup = "array = fg.Array.random(9000, pitch=5e-3); points = fg.plane(0.1, size=1.9, step=1e-3)"
    assert interrupted(setup, "fg.simulate(array, points, transducer='corrected')") < SOON_S
