"""The shader's program: well formed for all features, and nothing in it of what is off."""

from dataclasses import fields, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rtl.microcode import NO_TRIANGLE, NUM_REGISTERS, Assembler, Condition, Op, Store, X, Y, Z, instruction_layout
from rtl.shader_program import RAY_KINDS, ShaderFeatures, ray_kind, shader_program, stack_words

SWITCHES = [field.name for field in fields(ShaderFeatures) if field.type is bool]
NOTHING = ShaderFeatures(**dict.fromkeys(SWITCHES, False), depth=0)
LEAST = replace(NOTHING, point_lights=True)

def _consistent(switches):
    lights = switches["point_lights"] or switches["spot_lights"] or switches["directional_lights"]
    return lights and switches["reflection"] >= switches["refraction"]


some_features = st.builds(
    lambda depth, switches: ShaderFeatures(depth=depth, **switches), st.integers(0, 16),
    st.fixed_dictionaries({name: st.booleans() for name in SWITCHES}).filter(_consistent))


def ops(features):
    return {instruction["op"] for instruction in shader_program(features=features).instructions}


def successors(program, place, returns):
    instruction = program.instructions[place]
    if instruction["op"] is Op.EMIT:
        return []
    if instruction["op"] is Op.RETURN:
        return returns
    if instruction["op"] is Op.CALL:
        return [instruction["target"]]
    if instruction["op"] is Op.BRANCH:
        always = instruction["condition"] is Condition.ALWAYS
        return [instruction["target"]] + ([] if always else [place + 1])
    return [place + 1]


@settings(max_examples=150, deadline=None)
@given(some_features)
def test_every_instruction_is_reached_and_none_is_fallen_off(features):
    program = shader_program(features=features)
    returns = [k + 1 for k, instruction in enumerate(program.instructions) if instruction["op"] is Op.CALL]
    reached, waiting = set(), [0]
    while waiting:
        place = waiting.pop()
        assert place < len(program.instructions)
        if place not in reached:
            reached.add(place)
            waiting += successors(program, place, returns)
    assert len(program.instructions) - len(reached) <= 0, sorted(set(range(len(program.instructions))) - reached)


@settings(max_examples=50, deadline=None)
@given(some_features)
def test_instructions_fit_their_layout(features):
    program = shader_program(features=features)
    layout = instruction_layout(len(program.instructions))
    for instruction in program.instructions:
        assert layout.const(instruction).as_value() is not None
        assert instruction["dst"] < NUM_REGISTERS
        if instruction["op"] in (Op.LOAD, Op.TEXTURE):
            assert instruction["dst"] + (3 if instruction["op"] is Op.LOAD else 1) < NUM_REGISTERS


@pytest.mark.parametrize(("absent", "features"), [
    ({Op.TEXTURE}, ShaderFeatures(textures=False, sky=False)),
    ({Op.PUSH, Op.POP, Op.CALL, Op.RETURN}, ShaderFeatures(refraction=False, transparency=False)),
    ({Op.PUSH, Op.POP}, ShaderFeatures(depth=0, shadows=False)),
    ({Op.DECODE}, ShaderFeatures(emission=False)),
    ({Op.OFFSET}, replace(LEAST, spot_lights=True)),
    ({Op.TEXTURE, Op.PUSH, Op.POP, Op.CALL, Op.RETURN, Op.DECODE, Op.BYTES, Op.OFFSET}, LEAST),
])
def test_what_is_off_takes_no_instruction(absent, features):
    assert ops(features).isdisjoint(absent)
    assert ops(ShaderFeatures()) >= absent


@pytest.mark.parametrize("name", SWITCHES)
def test_each_feature_takes_instructions(name):
    everything = ShaderFeatures(refraction=name != "reflection")
    assert len(shader_program(features=replace(everything, **{name: False})).instructions) < len(
        shader_program(features=everything).instructions)


def test_the_whole_program_is_small():
    program = shader_program(features=ShaderFeatures(depth=16))
    assert len(program.instructions) <= 400
    assert len(program.literals) <= 16
    assert len(shader_program(features=LEAST).instructions) <= 44


def test_only_vectors_are_stored():
    for instruction in shader_program(features=ShaderFeatures()).instructions:
        assert instruction["op"] is Op.VECTOR or instruction["store"] is Store.NOWHERE


def test_every_kind_of_ray_is_counted():
    program = shader_program(features=ShaderFeatures())
    counted = {ray_kind(label) for label in program.labels} - {None}
    assert counted == set(range(len(RAY_KINDS)))
    assert ray_kind("hit") is None


def test_stack_words():
    assert stack_words(ShaderFeatures(depth=4)) == 4 * 8 + 7
    assert stack_words(ShaderFeatures(depth=4, shadows=False)) == 4 * 8
    assert stack_words(replace(LEAST, depth=4, shadows=True)) == 0


def test_depth_out_of_range():
    with pytest.raises(ValueError, match="depth is 17; it must be from 0 to 16"):
        ShaderFeatures(depth=17)


def test_refraction_needs_reflection():
    with pytest.raises(ValueError, match="refraction needs reflection"):
        ShaderFeatures(reflection=False)


def test_missing_features_by_name():
    assert LEAST.missing(replace(LEAST, sky=True, emission=True, depth=9)) == ["emission", "sky"]
    assert ShaderFeatures(depth=0).missing(ShaderFeatures()) == []


def test_assembler():
    assembler = Assembler()
    one, other = assembler.literal(1), assembler.literal(1.0)
    assert one != other
    assert assembler.literal(1, 1, 1) == one
    assert assembler.literal(NO_TRIANGLE, 0, 0) not in (one, other)
    assembler.label("begin")
    assembler.emit(Op.MOVE, dst=3, x=(5, (X, "-", Y, "-", Z)))
    assembler.emit(Op.BRANCH, target="begin", x=(4, Z))
    program = assembler.assembled()
    assert program.instructions[0]["negate"] == 6
    assert program.instructions[0]["select"] == [0, 1, 2]
    assert program.instructions[1]["select"] == [2, 2, 2]
    assert program.instructions[1]["target"] == 0
    with pytest.raises(ValueError, match="label 'begin' is there twice"):
        assembler.label("begin")
    assembler.emit(Op.BRANCH, target="nowhere")
    with pytest.raises(ValueError, match="label 'nowhere' is missing"):
        assembler.assembled()
    with pytest.raises(ValueError, match="three floats or three integers"):
        assembler.literal(1, 2.0, 3)
