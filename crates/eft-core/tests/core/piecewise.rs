//! The piecewise linear map and the flow table: correct at the knots and between them, monotone to the last bit.

use eft_core::{ConfigError, FlowTable, LARGEST, PiecewiseLinear};
use proptest::prelude::*;

use crate::rig;

/// Linear interpolation in f64 through the map's knots, as an independent value.
fn reference(knots: &[(f64, f64)], x: f64) -> (f64, f64) {
    let last = knots.len() - 1;
    let x = x.clamp(knots[0].0, knots[last].0);
    let i = (1..last).find(|&i| x < knots[i].0).unwrap_or(last);
    let ((x0, y0), (x1, y1)) = (knots[i - 1], knots[i]);
    let slope = (y1 - y0) / (x1 - x0);
    (y0 + (x - x0) * slope, slope)
}

macro_rules! properties {
    ($name:ident, $t:ty) => {
        mod $name {
            use super::*;

            fn knots<const N: usize>(map: &PiecewiseLinear<$t, N>) -> Vec<(f64, f64)> {
                map.knots().map(|(x, y)| (f64::from(x), f64::from(y))).collect()
            }

            /// Knots with their three neighbours on either side, points between and beyond, in order.
            fn probes<const N: usize>(map: &PiecewiseLinear<$t, N>, parts: &[f64]) -> Vec<$t> {
                let xs: Vec<$t> = map.knots().map(|(x, _)| x).collect();
                let (first, last) = (xs[0], xs[xs.len() - 1]);
                let mut probes = vec![first - 1.0, last + 1.0, <$t>::MIN, <$t>::MAX];
                for &x in &xs {
                    let (mut up, mut down) = (x, x);
                    probes.push(x);
                    for _ in 0..3 {
                        (up, down) = (up.next_up(), down.next_down());
                        probes.extend([up, down]);
                    }
                }
                probes.extend(parts.iter().map(|&p| first + (last - first) * p as $t));
                probes.sort_by(|a, b| a.total_cmp(b));
                probes
            }

            proptest! {
                #[test]
                fn map_meets_its_knots_and_stays_constant_beyond((xs, ys) in rig::tables(21)) {
                    let map = PiecewiseLinear::<$t, 21>::new("x", &xs, "y", &ys).unwrap();
                    prop_assert_eq!(map.knots().count(), xs.len());
                    for ((x, _), (&x0, &y0)) in map.knots().zip(xs.iter().zip(&ys)) {
                        prop_assert_eq!(x.to_bits(), (x0 as $t).to_bits());
                        prop_assert_eq!(map.eval(x).to_bits(), (y0 as $t).to_bits());
                    }
                    let (low, high) = (xs[0] as $t, xs[xs.len() - 1] as $t);
                    for (x, at) in [(low.next_down(), low), (<$t>::NEG_INFINITY, low), (<$t>::NAN, low),
                                    (high.next_up(), high), (<$t>::INFINITY, high)] {
                        prop_assert_eq!(map.eval(x).to_bits(), map.eval(at).to_bits());
                                                                    }
                }

                #[test]
                fn flag_marks_the_ends_to_within_rounding((xs, ys) in rig::tables(21), part in 0.0..1.0f64) {
                    let map = PiecewiseLinear::<$t, 21>::new("x", &xs, "y", &ys).unwrap();
                    let (low, high) = (xs[0] as $t, xs[xs.len() - 1] as $t);
                    let near = 8.0 * <$t>::EPSILON * (low.abs() + high.abs());
                    for x in [low - near, high + near, <$t>::NEG_INFINITY, <$t>::INFINITY, <$t>::NAN] {
                        prop_assert!(map.eval_flagged(x).1, "{x}");
                    }
                    let inside = low + near + (high - low - 2.0 * near) * part as $t;
                    prop_assert!(!map.eval_flagged(inside).1, "{inside}");
                }

                #[test]
                fn map_interpolates((xs, ys) in rig::tables(40), parts in prop::collection::vec(-0.1..1.1f64, 50)) {
                    let map = PiecewiseLinear::<$t, 64>::new("x", &xs, "y", &ys).unwrap();
                    let knots = knots(&map);
                    let size = knots.iter().fold(0.0, |m: f64, (_, y)| m.max(y.abs()));
                    let span = knots[knots.len() - 1].0 - knots[0].0 + knots[0].0.abs();
                    for x in probes(&map, &parts) {
                        let (expected, slope) = reference(&knots, f64::from(x));
                        let error = (f64::from(map.eval(x)) - expected).abs();
                        // Rounding of the value and of x, which may round to the lower end.
                        let rounding = f64::from(<$t>::EPSILON) * (3.0 * size + 4.0 * slope * span);
                        prop_assert!(error <= rounding, "at {x}: {error}");
                    }
                }

                #[test]
                fn map_is_monotone_to_the_last_bit(
                    (xs, ys) in rig::tables(64),
                    parts in prop::collection::vec(-0.1..1.1f64, 100),
                ) {
                    let map = PiecewiseLinear::<$t, 64>::new("x", &xs, "y", &ys).unwrap();
                    let values: Vec<$t> = probes(&map, &parts).into_iter().map(|x| map.eval(x)).collect();
                    for pair in values.windows(2) {
                        prop_assert!(pair[0] <= pair[1], "{} then {}", pair[0], pair[1]);
                    }
                }

                #[test]
                fn inverse_undoes_forward((xs, ys) in rig::tables(21), parts in prop::collection::vec(0.0..1.0f64, 50)) {
                    let table = FlowTable::<$t, 21>::new(&xs, &ys).unwrap();
                    let knots = knots(table.forward());
                    let (low, high) = (knots[0].0, knots[knots.len() - 1].0);
                    let size = |pick: fn(&(f64, f64)) -> f64| knots.iter().fold(0.0, |m: f64, k| m.max(pick(k).abs()));
                    let (opening_size, flow_size) = (size(|k| k.0), size(|k| k.1));
                    for x in probes(table.forward(), &parts) {
                        let within = f64::from(x).clamp(low, high);
                        let (_, slope) = reference(&knots, within);
                        let error = (f64::from(table.opening(table.flow(x))) - within).abs();
                        let rounding = 6.0 * f64::from(<$t>::EPSILON) * (opening_size + flow_size / slope);
                        // The flow may round into the next segment, whose slope then applies.
                        let steepest = knots.windows(2).map(|k| (k[1].1 - k[0].1) / (k[1].0 - k[0].0))
                            .fold(f64::MAX, f64::min);
                        let at_knot = 6.0 * f64::from(<$t>::EPSILON) * (opening_size + flow_size / steepest);
                        let near = knots.iter().any(|k| (k.0 - within).abs() <= at_knot);
                        prop_assert!(error <= if near { at_knot } else { rounding }, "at {x}: {error}");
                    }
                }

                #[test]
                fn any_table_is_built_or_refused(
                    xs in prop::collection::vec(prop_oneof![any::<f64>(), -1.0..1.0f64], 0..12),
                    ys in prop::collection::vec(prop_oneof![any::<f64>(), -1.0..1.0f64], 0..12),
                    sort in any::<bool>(),
                    x in any::<f64>(),
                ) {
                    let (mut xs, mut ys) = (xs, ys);
                    if sort {
                        let len = xs.len().min(ys.len());
                        xs.truncate(len);
                        ys.truncate(len);
                        xs.retain(|x| !x.is_nan());
                        ys.retain(|y| !y.is_nan());
                        xs.sort_by(f64::total_cmp);
                        ys.sort_by(f64::total_cmp);
                    }
                    if let Ok(map) = PiecewiseLinear::<$t, 8>::new("x", &xs, "y", &ys) {
                        prop_assert!(xs.len() == ys.len() && xs.len() <= 8);
                        let parts: Vec<f64> = (0..50).map(|i| f64::from(i) / 50.0).collect();
                        let values: Vec<$t> = probes(&map, &parts).into_iter().map(|x| map.eval(x)).collect();
                        prop_assert!(values.iter().all(|v| v.is_finite()));
                        prop_assert!(values.windows(2).all(|v| v[0] <= v[1]));
                        prop_assert!(map.eval(x as $t).is_finite());
                    }
                }
            }

            #[test]
            fn origin_at_zero_is_found_quickly() {
                let map = PiecewiseLinear::<$t, 2>::new("x", &[1.0, 63.0], "y", &[0.0, 1.0]).unwrap();
                assert_eq!((map.eval(1.0), map.eval(32.0), map.eval(63.0)), (0.0, 0.5, 1.0));
            }

            #[test]
            fn crowded_knots_far_from_zero_keep_their_order() {
                let x = [1.0, 1.0 + 1.0e-7, 1.0 + 3.0e-7, 1.0 + 9.0e-7];
                let map = PiecewiseLinear::<$t, 4>::new("x", &x, "y", &[0.0, 1.0, 2.0, 3.0]).unwrap();
                for (x, y) in map.knots() {
                    assert_eq!(map.eval(x), y);
                }
            }

            #[test]
            fn paper_table_needs_few_comparisons() {
                let table = FlowTable::<$t, 21>::new(rig::PARAMETERS.openings, rig::PARAMETERS.flows).unwrap();
                assert!(!table.inverse().is_crowded() && !table.forward().is_crowded());
                let half = table.flow(0.55);
                assert!((f64::from(half) / rig::IN3 - 0.5 * (369.8 + 411.2)).abs() < 1e-4);
                assert!((table.opening(half) - 0.55).abs() < 4.0 * <$t>::EPSILON);
            }

            #[test]
            fn refusals_name_table_and_index() {
                let new = |x: &[f64], y: &[f64]| FlowTable::<$t, 4>::new(x, y).map(|_| ());
                let not = |parameter, index| Err(ConfigError::NotIncreasing { parameter, index });
                assert_eq!(new(&[0.0, 1.0, 1.0], &[0.0, 1.0, 2.0]), not("openings", 2));
                assert_eq!(new(&[0.0, 1.0], &[0.0, -1.0]), not("flows", 1));
                let entry = |parameter, index, value| {
                    Err(ConfigError::Entry { parameter, index, value, lowest: -LARGEST, highest: LARGEST })
                };
                for lost in [f64::INFINITY, -1.001 * LARGEST, 2.0e38] {
                    assert_eq!(new(&[0.0, 1.0, lost], &[0.0, 1.0, 2.0]), entry("openings", 2, lost));
                    assert_eq!(new(&[0.0, 1.0, 2.0], &[lost, 1.0, 2.0]), entry("flows", 0, lost));
                }
                let error = new(&[0.0, f64::NAN], &[0.0, 1.0]).unwrap_err();
                assert_eq!(error.to_string(), "openings[1] = NaN: must lie in [-1e12, 1e12]");
                assert_eq!(
                    new(&[0.0], &[0.0]),
                    Err(ConfigError::Length { parameter: "openings", length: 1, shortest: 2, longest: 4 })
                );
                assert_eq!(
                    new(&[0.0, 1.0], &[0.0]),
                    Err(ConfigError::Length { parameter: "flows", length: 1, shortest: 2, longest: 2 })
                );
            }
        }
    };
}
properties!(single, f32);
properties!(double, f64);

#[test]
fn knots_that_merge_in_f32_are_refused_there_only() {
    let (x, y) = ([0.0, 1.0, 1.0 + 1.0e-9], [0.0, 1.0, 2.0]);
    assert!(FlowTable::<f64, 3>::new(&x, &y).is_ok());
    let merged = Err(ConfigError::NotIncreasing { parameter: "openings", index: 2 });
    assert_eq!(FlowTable::<f32, 3>::new(&x, &y).map(|_| ()), merged);
}

#[test]
fn a_table_too_narrow_for_its_index_is_refused() {
    let narrow = [0.0, 5.0e-39, 1.0e-38];
    let refused = FlowTable::<f32, 3>::new(&narrow, &narrow).map(|_| ());
    assert_eq!(refused, Err(ConfigError::TooSteep { parameter: "flows", index: 2 }));
}

#[test]
fn slopes_that_overflow_are_refused() {
    let steep = FlowTable::<f32, 2>::new(&[0.0, 1.0e-38], &[0.0, 100.0]).map(|_| ());
    assert_eq!(steep, Err(ConfigError::TooSteep { parameter: "flows", index: 1 }));
}
