"""Names with parameters in brackets: what is written is what is read."""

from __future__ import annotations

import json
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget_bench.errors import BenchError
from retarget_bench.plugins.spec import Spec

NAMES = st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,30}", fullmatch=True)
KEYS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,10}", fullmatch=True)
SCALARS = st.one_of(
    st.text(max_size=20),
    st.integers(),
    st.booleans(),
    st.floats(allow_nan=False, allow_infinity=False),
    st.sampled_from(
        ["true", "False", "1", "1e-3", "007", " a ", 'a"b', "a'b", "\\", "x,y]", "+", "inf", ""]
    ),
)


@given(NAMES, st.dictionaries(KEYS, SCALARS, max_size=4))
def test_the_canonical_form_reads_as_the_same_spec(name, parameters):
    spec = Spec(name, parameters)
    again = Spec.parse(str(spec))
    assert again.name == name
    assert again.parameters == parameters
    assert {k: type(v) for k, v in again.parameters.items()} == {k: type(v) for k, v in parameters.items()}


PLUGINS = st.builds(Spec, NAMES, st.dictionaries(KEYS, SCALARS, max_size=2))


@given(PLUGINS, st.text(min_size=1, max_size=30).filter(str.strip), st.lists(PLUGINS, max_size=3))
def test_so_does_a_method_with_post_processes_of_another_environment(method, environment, posts):
    spec = Spec(method.name, method.parameters, tuple(posts), environment)
    again = Spec.parse(str(spec))
    assert (again, again.environment, again.alone) == (spec, environment, method)
    assert again.posts == tuple(posts)
    assert again.names.split("+") == [method.name, *(post.name for post in posts)]
    assert str(again.here) == str(Spec(method.name, method.parameters, tuple(posts)))
    assert again.slug != again.here.slug
    assert re.fullmatch(r"[a-z0-9_.-]{1,60}", spec.slug)


@pytest.mark.parametrize(
    ("text", "environment"),
    [
        ("pan@/usr/bin/python3.10", "/usr/bin/python3.10"),
        ("pan[a=1]@python3.10-3f2a91c0+fix", "python3.10-3f2a91c0"),
        ("pan @ 'conda run -n old python' + fix", "conda run -n old python"),
        ("pan@C:\\old\\python.exe", "C:\\old\\python.exe"),
    ],
)
def test_an_environment_follows_an_at_sign(text, environment):
    assert Spec.parse(text).environment == environment


def test_compositions_that_differ_have_slugs_that_differ():
    texts = "a", "a+b", "a+c", "a+b+c", "a+c+b", "a[x=1]+b", "a+b[x=1]", "a[x=1]", "a-b", "a-b+c", "a+b-c"
    slugs = {Spec.parse(text).slug for text in texts}
    assert len(slugs) == len(texts)
    assert Spec.parse(" a [x=1] + b [ y = 2 ] ") == Spec.parse("a[x=1]+b[y=2]")
    assert str(Spec.parse("a+b[y=2]").with_parameters(x=1)) == "a[x=1]+b[y=2]"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("copy_rotations", {}),
        ("copy_rotations[]", {}),
        ("m[rule=height]", {"rule": "height"}),
        ("m[ n = 3 , x=-1.5e-3 ]", {"n": 3, "x": -0.0015}),
        ("m[a=true,b=False,c=no]", {"a": True, "b": False, "c": "no"}),
        ("m[a=.5,b=5.,c=007,d=1_000]", {"a": 0.5, "b": 5.0, "c": "007", "d": "1_000"}),
        ("m[root=/data/my clips/v1.2+x]", {"root": "/data/my clips/v1.2+x"}),
        ("m[root=C:\\clips\\new]", {"root": "C:\\clips\\new"}),
        ('m[a="1",b=\'x,]["\',c="q\\"\\\\"]', {"a": "1", "b": 'x,]["', "c": 'q"\\'}),
    ],
)
def test_values_have_the_type_they_look_like(text, expected):
    actual = Spec.parse(text).parameters
    assert actual == expected
    assert [type(actual[k]) for k in sorted(expected)] == [type(expected[k]) for k in sorted(expected)]


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("", "character 1"),
        ("[a=1]", "character 1"),
        ("m[a=1", "character 6, found the end"),
        ("m[a]", "expected '=' after a at character 4"),
        ("m[a=]", "a value for a"),
        ("m[a=1]x", "found 'x'"),
        ('m@""', "nothing follows @"),
        ("m[a=1 b=2]", "character 8"),
        ("m[a=1,,b=2]", "found ','"),
        ("m[a='x]", "closing quote of a"),
        ("m[a=1,a=2]", "'a' is given twice"),
        ("pan+", "a name such as copy_rotations at character 5, found the end"),
        ("+footfix", "character 1, found '+'"),
        ("pan+footfix[a=1]x", "expected '+' or the end at character 17, found 'x'"),
        ("pan]", "expected '[', '+' or the end at character 4"),
        ("x" * 51, "longer than the 50 characters"),
    ],
)
def test_mistakes_are_named_with_their_place(text, place):
    with pytest.raises(BenchError, match=re.escape(place)):
        Spec.parse(text)


def test_order_of_writing_does_not_matter_but_types_do():
    assert Spec.parse("m[b=2,a=1]") == Spec.parse("m[a=1,b=2]")
    assert str(Spec.parse("m[b=2,a=x]")) == "m[a=x,b=2]"
    assert (
        len({Spec.parse("m[a=1]"), Spec.parse("m[a=1.0]"), Spec.parse("m[a=true]"), Spec.parse("m")}) == 4
    )


def test_slugs_are_file_names_that_differ_with_the_parameters():
    assert Spec.parse("copy_rotations").slug == "copy_rotations"
    slugs = {Spec.parse(f"m[rule={rule}]").slug for rule in ("a", "b", "A", "1", "'1'")}
    assert len(slugs) == 5
    assert all(re.fullmatch(r"m-[0-9a-f]{8}", slug) for slug in slugs)
    longest = Spec("x" * 50, {"a": "/" * 500}).slug
    assert re.fullmatch(r"[a-z0-9_.-]{1,60}", longest)


def test_the_slug_is_the_hash_of_sorted_json_and_does_not_move():
    import hashlib

    text = json.dumps({"a": 1, "rule": "height"}, separators=(",", ":"))
    expected = hashlib.sha256(text.encode()).hexdigest()[:8]
    assert Spec.parse("m[rule=height,a=1]").slug == f"m-{expected}" == "m-fb03e68e"
