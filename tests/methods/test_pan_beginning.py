"""What is our own in PAN: structures that begin alike, and paths that are carried."""

from __future__ import annotations

import pan_material
import torch


def structures(**parameters):
    return pan_material.training_module(**parameters)._structures


def test_what_structures_share_begins_alike():
    plain, short = structures().values()
    for name, first in plain.encoder.named_parameters():
        second = dict(short.encoder.named_parameters())[name]
        if first.shape == second.shape:
            assert torch.equal(first, second), name
    outputs = [dict(zip(each.layout.roles[1:], _biases(each), strict=True)) for each in (plain, short)]
    both = [role for role in outputs[0] if role and role in outputs[1]]
    assert len(both) > 10
    assert all(torch.equal(outputs[0][role], outputs[1][role]) for role in both)


def test_slots_of_one_role_are_heard_alike():
    plain, short = structures().values()
    heard = [_heard(each) for each in (plain, short)]
    both = heard[0].keys() & heard[1].keys()
    assert ("left_arm", "left_hand") in both
    assert all(torch.equal(heard[0][key], heard[1][key]) for key in both)


def test_published_variants_begin_each_for_itself():
    plain, short = structures(variant="released").values()
    assert not torch.equal(plain.decoder.inner.weight, short.decoder.inner.weight)


def _biases(structure):
    return structure.decoder.outer.bias.detach().view(-1, 4)[:-1]


def _heard(structure):
    """(part, role) -> weights of the convolution from the edges themselves."""
    layout = structure.layout
    weights = structure.encoder.raw.weight.detach()
    blocks, start = {}, 0
    for name, part in zip(layout.names, layout.parts, strict=True):
        for edge in (*part, layout.edges):
            role = "root" if edge == layout.edges else layout.roles[edge + 1]
            blocks[name, role] = weights[start : start + 4]
            start += 4
    return blocks
