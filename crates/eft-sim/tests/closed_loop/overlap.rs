//! Overlap and null bias from slow strokes on the virtual rig, compared with its true values.

use eft_sim::identification::{FlowTest, OverlapEstimate, Recording, flow_test, identify_overlap};
use eft_sim::{Result, RigConfig};

const RATE: f64 = 2048.0;
const AREA: f64 = 8.212e-3;

/// Slow strokes of about ±3 % of the spool on the virtual rig.
fn strokes(overlap: f64, null_bias: f64) -> FlowTest {
    let rig = RigConfig::zhao2005().with(|rig| {
        (rig.servovalve.overlap, rig.servovalve.null_bias) = (overlap, null_bias);
    });
    flow_test(&rig.unwrap(), 0.02, 0.5, 16.0, 20.0, RATE).unwrap()
}

fn found(test: &FlowTest) -> Result<OverlapEstimate> {
    identify_overlap(&[Recording { spool: &test.spool, displacement: &test.displacement }], RATE, AREA)
}

struct Noise(u64);

impl Noise {
    /// Uniform, of standard deviation 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt()
    }
}

#[test]
fn overlap_underlap_and_null_bias_of_the_virtual_rig_are_found() {
    for (overlap, bias) in [(1e-3, 0.0), (5e-3, 2e-3), (0.0, 0.0), (0.0, -3e-3), (-2e-3, 0.0)] {
        let found = found(&strokes(overlap, bias)).unwrap();
        let missed = (found.overlap.value - overlap).abs().max((found.null_bias.value - bias).abs());
        assert!(missed < 3e-5, "{overlap} {bias}: {found:?}");
    }
}

#[test]
fn with_noise_the_uncertainty_covers_the_error() {
    let clean = strokes(1e-3, 1e-3);
    let (mut noise, mut within, tests) = (Noise(5), 0, 20);
    for _ in 0..tests {
        let mut test = clean.clone();
        test.spool.iter_mut().for_each(|x| *x += 5e-4 * noise.next());
        test.displacement.iter_mut().for_each(|x| *x += 6e-5 * noise.next());
        let found = found(&test).unwrap();
        let [lap, bias] = [(found.overlap, 1e-3), (found.null_bias, 1e-3)]
            .map(|(estimate, truth)| (estimate.value - truth).abs() / estimate.uncertainty);
        assert!(found.overlap.uncertainty < 1e-4, "{found:?}");
        within += usize::from(lap < 2.0) + usize::from(bias < 2.0);
    }
    assert!(within >= 34, "{within} of {}", 2 * tests);
}

#[test]
fn unusable_data_are_refused_by_name() {
    let test = strokes(1e-3, 0.0);
    let refusal = |change: &dyn Fn(&mut FlowTest)| {
        let mut test = test.clone();
        change(&mut test);
        found(&test).unwrap_err().to_string()
    };
    assert!(refusal(&|t| t.spool.iter_mut().for_each(|x| *x *= 30.0)).contains("±0.2"));
    assert!(refusal(&|t| t.spool.iter_mut().for_each(|x| *x = x.abs())).contains("both sides"));
    assert!(refusal(&|t| t.displacement.iter_mut().for_each(|x| *x = -*x)).contains("check the signs"));
    assert!(refusal(&|t| t.displacement.fill(f64::NAN)).contains("without a gap"));
    assert!(refusal(&|t| t.displacement.truncate(200)).contains("as many"));
}
