use std::f64::consts::TAU;

use super::*;

const RATE: f64 = 1000.0;
const AREA: f64 = 0.0127;
/// Flow (m³/s) at an opening of one.
const FLOW: f64 = 0.01;

/// Flow (m³/s) of a curve of straight pieces between 11 points.
fn flow(opening: f64, bend: f64, skew: f64) -> f64 {
    let at = |k: f64| FLOW * k * (1.0 - bend * k.abs()) * (1.0 + skew * k.signum());
    let low = (opening * 5.0).floor();
    let share = opening * 5.0 - low;
    (1.0 - share) * at(low / 5.0) + share * at((low + 1.0) / 5.0)
}

#[test]
fn the_uncertainty_holds_with_noise_of_the_spool() {
    let mut state = 5_u64;
    let mut uniform = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (mut within, mut outer_within, mut points, mut outer, mut square) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for _ in 0..50 {
        let (bend, skew) = (0.2 * uniform(), 0.08 * (uniform() - 0.5));
        let (spool_noise, noise) = (2e-3 * uniform(), libm::pow(10.0, -7.0 + 3.0 * uniform()));
        let tests: Vec<(Vec<f64>, Vec<f64>)> = (0..2)
            .map(|_| {
                let (amplitude, frequency) = (0.45 + 0.5 * uniform(), 1.0 + 2.0 * uniform());
                let mut normal = || (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
                let opening = |i: usize| amplitude * (TAU * frequency * i as f64 / RATE).sin();
                let mut moved = 0.0;
                (0..3000)
                    .map(|i| {
                        let rate = |i| flow(opening(i), bend, skew) / AREA;
                        moved += 0.5 * (rate(i) + rate(i + 1)) / RATE;
                        (opening(i + 1) + spool_noise * normal(), moved + noise * normal())
                    })
                    .unzip()
            })
            .collect();
        let recordings: Vec<Recording<'_>> = tests
            .iter()
            .map(|(spool, displacement)| Recording {
                spool: spool.as_slice(),
                displacement: displacement.as_slice(),
            })
            .collect();
        let found = identify_flow_curve(&recordings, RATE, AREA, 11).unwrap();
        let reached: Vec<usize> = (0..11).filter(|k| found.measured[*k] && *k != 5).collect();
        for k in &reached {
            let off = (found.flows[*k] - flow(found.openings[*k], bend, skew)) / found.uncertainty[*k];
            let right = f64::from(off.abs() < 2.0);
            (within, points, square) = (within + right, points + 1.0, square + off * off);
            if k == &reached[0] || Some(k) == reached.last() {
                (outer_within, outer) = (outer_within + right, outer + 1.0);
            }
        }
    }
    let (all, outermost, rms) = (within / points, outer_within / outer, (square / points).sqrt());
    let share = 0.9..=0.995;
    assert!(
        share.contains(&all) && share.contains(&outermost) && (0.8..1.25).contains(&rms),
        "within two deviations {all:.3}, outermost {outermost:.3}, rms {rms:.2}"
    );
}
