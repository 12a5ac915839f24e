"""Serialised states: they go on in another process to the last bit, and damaged bytes are refused."""

import os
import random
import subprocess
import sys

import numpy as np
import pytest
import serialised
from koppel import FmuError, Status, paths, scenes
from serialised import METHODS, WAYS, go_on, open_instance, tunable

NAMES = sorted(folder.parent.name for folder in (paths.ROOT / "fmus").glob("*/Cargo.toml"))
each_fmu = pytest.mark.parametrize("name", NAMES)
BEFORE, AFTER = 7, 12
#: What Model Exchange needs for the midpoint rule at 10 ms: bristles of friction are a hundred times as fast.
SLOW = {"effi_plant": {"friction.model": "viscous"}}


def in_another_process(fmu, way, data, folder):
    """The same steps from serialised bytes in a fresh process."""
    state, result = folder / "state", folder / "result"
    state.write_bytes(data)
    arguments = [fmu.path, way, state, str(BEFORE), str(AFTER), result]
    environment = {**os.environ, "PYTHONPATH": ":".join(sys.path)}
    subprocess.run([sys.executable, serialised.__file__, *arguments], check=True, env=environment)
    return np.frombuffer(result.read_bytes()).reshape(AFTER, -1)


def cut(fmu, way, start_values):
    """Bytes of the state in the middle of a run that was tuned before, and the run after it."""
    with open_instance(fmu, way) as instance:
        instance.initialise(start_values)
        go_on(fmu, instance, way, 0, 2)
        if way == "cs":
            instance.set(tunable(fmu))
        go_on(fmu, instance, way, 2, BEFORE - 2)
        saved = instance.save()
        data = instance.serialise(saved)
        assert data == instance.serialise(saved)
        instance.free_state(saved)
        return data, go_on(fmu, instance, way, BEFORE, AFTER)


@each_fmu
@pytest.mark.parametrize("way", WAYS)
def test_another_process_goes_on_to_the_last_bit(fmu, name, way, tmp_path):
    one = fmu(name)
    if way == "me" and one.description.modelExchange is None:
        pytest.skip("Co-Simulation only")
    data, expected = cut(one, way, SLOW.get(name, {}) if way == "me" else {})
    there = in_another_process(one, way, data, tmp_path)
    assert np.ptp(expected, axis=0).max() > 0.0, "nothing moves"
    assert there.tobytes() == expected.tobytes()


@pytest.mark.parametrize("method", METHODS)
def test_every_method_takes_its_memory_along(wishbone, method, tmp_path):
    values = {**scenes.ROAD, "solver.method": method, "solver.step": 0.005, "solver.rtol": 1e-5}
    data, expected = cut(wishbone, "cs", values)
    assert in_another_process(wishbone, "cs", data, tmp_path).tobytes() == expected.tobytes()


BUILT = {"spatial": scenes.SPATIAL, "static": {"strut.preload_mode": "static", "gravity.z": -9.81}}


@pytest.mark.parametrize("values", BUILT.values(), ids=BUILT)
def test_the_model_is_built_again_as_it_was(wishbone, values, tmp_path):
    data, expected = cut(wishbone, "cs", values)
    assert in_another_process(wishbone, "cs", data, tmp_path).tobytes() == expected.tobytes()


def test_a_state_from_before_initialisation_keeps_what_was_set(wishbone):
    with wishbone.instantiate() as instance:
        instance.set({"carrier.mass": 31.0, "P.F.z": 3.0})
        saved = instance.save()
        data = instance.serialise(saved)
        instance.free_state(saved)
        instance.initialise({})
        expected = go_on(wishbone, instance, "cs", 0, 5)
    with wishbone.instantiate() as other:
        state = other.deserialise(data, at=None)
        other.restore(state)
        other.free_state(state)
        other.initialise({})
        assert go_on(wishbone, other, "cs", 0, 5).tobytes() == expected.tobytes()


@pytest.fixture
def stepped(wishbone):
    """An instance that has done a step, with the bytes of its state."""
    with wishbone.instantiate() as instance:
        instance.initialise({})
        instance.step(0.0, 0.1)
        saved = instance.save()
        data = instance.serialise(saved)
        instance.free_state(saved)
        yield instance, data


def refusal(instance, data):
    """What the instance says about wrong bytes; it stays as it is."""
    names = instance.fmu.names("output")
    before = instance.get_all(names)
    with pytest.raises(FmuError) as refused:
        instance.deserialise(data, at=0.1)
    assert refused.value.status == Status.ERROR
    assert instance.get_all(names) == before
    return "\n".join(message.text for message in refused.value.messages)


def test_every_part_of_the_bytes_is_checked(stepped):
    instance, data = stepped
    wrong = lambda i: data[:i] + bytes([data[i] ^ 0x10]) + data[i + 1 :]
    for text, damaged in [
        ("length", b""),
        ("length", data[:20]),
        ("length", data[:-1]),
        ("length", data + b"\0"),
        ("version", wrong(0)),
        ("length", wrong(4)),
        ("token", wrong(12)),
        ("checksum", wrong(28)),
        ("checksum", wrong(len(data) // 2)),
        ("checksum", wrong(len(data) - 1)),
    ]:
        assert f"serialised state is refused: {text}" in refusal(instance, damaged)
    instance.step(0.1, 0.1)


def test_random_damage_is_refused(stepped):
    instance, data = stepped
    chance = random.Random(1)
    for _ in range(300):
        damaged = bytearray(data)
        for _ in range(chance.randint(1, 8)):
            damaged[chance.randrange(len(data))] ^= chance.randint(1, 255)
        if chance.random() < 0.2:
            del damaged[chance.randrange(len(damaged)) :]
        if bytes(damaged) != data:
            assert "serialised state is refused" in refusal(instance, bytes(damaged))
    instance.step(0.1, 0.1)


def checksum(data):
    """FNV-1a with 128 bits of the bytes and a closing 0xff."""
    value = 0x6C62272E07BB014262B821756295C58D
    for byte in [*data, 0xFF]:
        value = (value ^ byte) * 0x0000000001000000000000000000013B % 2**128
    return value.to_bytes(16, "little")


def test_forged_content_never_breaks_the_instance(stepped):
    """With a right checksum only the content is left to be looked at: lists of other lengths, other parameters."""
    instance, data = stepped
    assert checksum(data[:-16]) == data[-16:]
    chance, refused = random.Random(3), 0
    for i in range(300):
        forged = bytearray(data[:-16])
        # every other time among the first bytes: interface, phase and the length of the values
        place = 28 + (i // 2 % 8 if i % 2 else chance.randrange(len(forged) - 28))
        forged[place] = 0xFF if i % 3 == 0 else chance.randrange(256)
        try:
            instance.free_state(instance.deserialise(bytes(forged) + checksum(forged), at=0.1))
        except FmuError as error:
            assert error.status == Status.ERROR
            assert "content is not a state of this model" in str(error)
            refused += 1
    assert refused > 50
    instance.step(0.1, 0.1)


def test_the_state_of_another_fmu_is_refused(stepped, fmu):
    instance, _ = stepped
    data, _ = cut(fmu("double_pendulum"), "cs", {})
    assert "token" in refusal(instance, data)


def test_the_state_of_another_interface_is_refused(wishbone, stepped):
    _, data = stepped
    with wishbone.equations() as equations:
        state = equations.deserialise(data, at=0.1)
        with pytest.raises(FmuError, match="Co-Simulation") as refused:
            equations.restore(state)
        assert refused.value.status == Status.ERROR
        equations.free_state(state)
        equations.initialise({})
