//! The nodes of the flow curve's correction: which of them move, when they are refreshed, and the inverse of the map.

#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use crate::compensation::{NODES, PIECES};
use crate::learning::curve_nodes::{CurveNodes, interpolate, inverse_at};

/// The node at no flow.
const ZERO: usize = PIECES / 2;

/// A departure and its variance after one error of a tenth of a step at the node.
fn moved(node: usize, noise: f64) -> [f64; 2] {
    let (mut nodes, mut departures) = (CurveNodes::<f64>::default(), [0.0; NODES]);
    let before = nodes.variances[node];
    nodes.correct(&mut departures, node, [node as f64 - ZERO as f64, 0.1], [noise, 0.0]);
    [departures[node], nodes.variances[node] - before]
}

#[test]
fn the_node_at_zero_and_the_ends_do_not_move() {
    for node in [0, ZERO, NODES - 1] {
        // Without noise nothing but this rule keeps the node at zero from 0/0.
        for noise in [1e-2, 0.0] {
            assert_eq!(moved(node, noise).map(f64::to_bits), [0; 2], "node {node}");
        }
    }
    for node in [1, ZERO - 1, ZERO + 1, NODES - 2] {
        let [departure, variance] = moved(node, 1e-2);
        assert!(departure > 0.0 && variance < 0.0, "node {node}: {departure} {variance}");
    }
}

#[test]
fn a_node_beyond_the_ends_is_ignored() {
    let (mut nodes, mut departures) = (CurveNodes::<f64>::default(), [0.0; NODES]);
    let before = nodes;
    nodes.correct(&mut departures, NODES, [9.0, 0.1], [1e-2, 0.0]);
    assert!(nodes == before && departures.iter().all(|departure| departure.to_bits() == 0));
}

#[test]
fn a_window_between_two_nodes_moves_each_by_its_nearness() {
    let (at, noise) = (3.25, 1e-2);
    let (mut nodes, mut departures) = (CurveNodes::<f64>::default(), [0.0; NODES]);
    for (flow, weight) in [(3.0, 0.75), (4.0, 0.25)] {
        let node = ZERO + flow as usize;
        nodes.correct(&mut departures, node, [at, 0.1], [noise, 0.0]);
        // A belief of 5 % of the node's flow, and a measurement of `weight` times the departure.
        let belief = 0.0025 * flow * flow;
        let share = belief / (weight * weight * belief + noise);
        assert!((departures[node] - share * weight * 0.1).abs() < 1e-15, "node {node}");
        assert!((nodes.variances[node] - share * noise).abs() < 1e-15, "node {node}");
    }
}

#[test]
fn a_departure_is_at_most_a_fifth_of_its_flow() {
    for (node, error, most) in [(ZERO + 3, 100.0, 0.6), (ZERO + 3, -100.0, -0.6), (ZERO - 5, 100.0, 1.0)] {
        let (mut nodes, mut departures) = (CurveNodes::<f64>::default(), [0.0; NODES]);
        nodes.correct(&mut departures, node, [node as f64 - ZERO as f64, error], [1e-2, 0.0]);
        assert!((departures[node] - most).abs() < 1e-12, "{}", departures[node]);
    }
}

/// The nodes that this number of updates has moved to a departure of a tenth of a step.
fn refreshed(nodes: &mut CurveNodes<f64>, updates: u32) -> [bool; NODES] {
    let departures = [0.1; NODES];
    let before = nodes.pieces;
    for _ in 0..updates {
        nodes.refresh_next(&departures, 0.0, 1.0);
    }
    let moved = |node: usize| node > 0 && node < PIECES && nodes.pieces[node] != before[node];
    core::array::from_fn(|node| moved(node) && nodes.pieces[node - 1] != before[node - 1])
}

#[test]
fn the_nodes_beside_the_last_flow_are_refreshed_within_four_updates() {
    for below in [0, 5, 11, PIECES - 2] {
        let mut nodes = CurveNodes::default();
        nodes.visit(below);
        let found = refreshed(&mut nodes, 4);
        for node in [below.max(1), below + 1] {
            assert!(found[node], "node {node} of a flow above {below}");
        }
    }
    // A flow beyond the nodes counts as one at the first.
    let (mut beyond, mut first) = (CurveNodes::default(), CurveNodes::default());
    for below in [NODES, NODES + 4] {
        beyond.visit(below);
        first.visit(0);
        assert_eq!(refreshed(&mut beyond, 4), refreshed(&mut first, 4));
        assert!(beyond == first);
    }
}

#[test]
fn the_flow_before_the_map_is_found_from_that_after_it() {
    // Nodes at two thirds and four thirds of their flows in turn.
    let step = 0.7;
    let mut nodes = CurveNodes::<f64>::default();
    let departures: [f64; NODES] =
        core::array::from_fn(|node| if node.is_multiple_of(2) { 0.15 } else { -0.15 });
    for _ in 0..4 * NODES {
        nodes.refresh_next(&departures, 0.05, step);
    }
    for n in -79..=79 {
        let demand = 0.1 * f64::from(n);
        // The table's flow at a demand, between the nodes' flows.
        let at = |node: f64| {
            let inner = node.abs() < 8.0;
            let departure = if node.rem_euclid(2.0) > 0.5 { -0.15 } else { 0.15 };
            node + if inner { 0.05 * node.abs() + departure } else { 0.0 }
        };
        let low = demand.floor();
        let flow = at(low) + (demand - low) * (at(low + 1.0) - at(low));
        let found = inverse_at(&nodes.pieces, step, flow * step);
        assert!((found - demand * step).abs() < 1e-12, "{demand}: {found}");
    }
    for beyond in [-8.5 * step, 8.5 * step] {
        assert!((inverse_at(&nodes.pieces, step, beyond) - beyond).abs() < 1e-15);
    }
}

#[test]
fn departures_between_two_nodes_lie_on_a_line() {
    let mut departures = [0.0; NODES];
    (departures[ZERO + 2], departures[ZERO + 3]) = (0.3, -0.1);
    for (flow, expected) in [(1.5, 0.15), (2.0, 0.3), (2.25, 0.2), (3.0, -0.1), (3.5, -0.05), (9.0, 0.0)] {
        let found: f64 = interpolate(&departures, flow);
        assert!((found - expected).abs() < 1e-15, "{flow}: {found}");
    }
}
