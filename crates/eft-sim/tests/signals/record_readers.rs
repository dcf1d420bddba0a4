//! For any bytes a reader returns a valid record or an error, and never panics.

use eft_sim::records::{Record, parse};
use proptest::prelude::*;

const SAMPLES: [(&str, &[u8]); 8] = [
    ("a.at2", include_bytes!("../records/nga.AT2")),
    ("a.at2", include_bytes!("../records/oldest.at2")),
    ("a.at2", include_bytes!("../records/stuck.at2")),
    ("a.v2", include_bytes!("../records/csmip_three.V2")),
    ("a.v2", include_bytes!("../records/csmip.v2")),
    ("a.v2c", include_bytes!("../records/cosmos.v2c")),
    ("a.csv", include_bytes!("../records/two_columns.csv")),
    ("a.csv", include_bytes!("../records/european.csv")),
];

/// Texts that readers search for, or that are difficult for them.
const PIECES: [&[u8]; 24] = [
    b"NPTS=",
    b" DT= ",
    b"-",
    b".",
    b"e",
    b"1e308",
    b"NaN",
    b"\n",
    b"\r",
    b"\0",
    b",",
    b";",
    b"#",
    b"=",
    b"(8f10.5)",
    b"\xff\xfe",
    b"\xc3\xa9",
    b"points of accel data equally spaced at",
    b"acceleration pts",
    b"real-header values follow on",
    b"99999999999999999999",
    b" in g",
    b"units=",
    b"\t",
];

fn sound(record: &Record) -> bool {
    record.validate().is_ok() && record.pga().is_finite()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn arbitrary_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..400), name in "[a-z]{0,3}\\.(at2|v2|csv)") {
        if let Ok(record) = parse(&bytes, &name) {
            prop_assert!(sound(&record));
        }
    }

    #[test]
    fn pieces_in_any_order(
        parts in proptest::collection::vec((0..PIECES.len(), "[0-9 .\n-]{0,12}"), 0..40),
        name in "x\\.(at2|v2|csv)",
    ) {
        let bytes: Vec<u8> =
            parts.iter().flat_map(|(i, filler)| [PIECES[*i], filler.as_bytes()].concat()).collect();
        if let Ok(record) = parse(&bytes, &name) {
            prop_assert!(sound(&record));
        }
    }

    #[test]
    fn damaged_samples(
        which in 0..SAMPLES.len(),
        edits in proptest::collection::vec((any::<proptest::sample::Index>(), 0..PIECES.len(), 0_usize..30), 1..4),
    ) {
        let (name, sample) = SAMPLES[which];
        let mut bytes = sample.to_vec();
        for (at, piece, dropped) in edits {
            let at = at.index(bytes.len() + 1);
            let end = (at + dropped).min(bytes.len());
            bytes.splice(at..end, PIECES[piece].iter().copied());
        }
        if let Ok(record) = parse(&bytes, name) {
            prop_assert!(sound(&record));
        }
    }

    #[test]
    fn a_file_cut_short_is_an_error_or_lost_only_digits(
        which in 0_usize..6,
        at in any::<proptest::sample::Index>(),
    ) {
        let (name, sample) = SAMPLES[which];
        let cut = at.index(sample.len());
        if let Ok(record) = parse(&sample[..cut], name) {
            prop_assert_eq!(record.acceleration.len(), 12);
        }
    }

    #[test]
    fn written_columns_are_read_back(
        values in proptest::collection::vec(-20.0..20.0_f64, 2..200),
        steps_per_second in 10..5000_u32,
    ) {
        let dt = 1.0 / f64::from(steps_per_second);
        let mut text = String::from("t_s,ag_mps2\n");
        for (i, value) in values.iter().enumerate() {
            text += &format!("{},{value}\n", i as f64 * dt);
        }
        let record = parse(text.as_bytes(), "a.csv").unwrap();
        prop_assert_eq!(record.acceleration, values);
        prop_assert!((record.dt - dt).abs() <= 1e-11 * dt);
    }
}

/// An algorithm with quadratic time would take minutes for these lengths.
#[test]
fn long_lines_take_a_time_in_proportion_to_their_length() {
    let (gap, rows) = (" ".repeat(300_000), "0.00,1\n0.01,2\n0.02,1\n");
    let began = std::time::Instant::now();
    for (name, text) in [
        ("a.csv", format!("time{gap}(s),acc{gap}(g)\n{rows}")),
        ("a.csv", format!("# dt{gap}={gap}0.01{gap}\n{rows}")),
        ("a.csv", format!("#{}\n{rows}", "a=".repeat(300_000))),
        ("a.csv", format!("t,acc{}\n{rows}", "_g ".repeat(100_000))),
        ("a.csv", format!("time,{}b\n{}1\n", "acc,".repeat(100_000), "1,".repeat(100_001))),
        ("a.at2", format!("PEER{gap}\nname\nUNITS OF{gap}G\nNPTS={gap}3,{gap}DT={gap}.01\n 1 2 3\n")),
        ("a.at2", format!("PEER\nname\nUNITS OF G\nNPTS= 3, DT= .01\n {}\n", "1-".repeat(300_000))),
        (
            "a.v2",
            format!("3 points of accel data equally spaced at{gap}.01 sec, in{gap}g. (8f10.5)\n1 2 3\n"),
        ),
        ("a.v2", format!("3 acceleration pts, units={gap}g(04),{gap}Format=(8F10.5)\n1 2 3\n")),
        ("a.v2", "real-header values follow on\n\n1\n".repeat(20_000)),
        ("a.v2", "3 points of accel data equally spaced at .01 sec, in g.\n1 2 3\n".repeat(20_000)),
    ] {
        let answer = parse(text.as_bytes(), name).map(|record| record.dt).map_err(|error| error.to_string());
        assert!(answer.as_ref().is_ok_and(|dt| *dt == 0.01) || answer.is_err_and(|said| said.len() < 500));
    }
    assert!(began.elapsed().as_secs_f64() < 10.0, "{:?}", began.elapsed());
}
