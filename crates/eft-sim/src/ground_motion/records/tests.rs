//! A small file with the same twelve points in each format, and the messages for damaged files.

use super::*;

/// Ground acceleration in g at point `i` of every sample file.
fn point(i: usize) -> f64 {
    0.3 * (0.9 * i as f64).sin() * (-0.1 * i as f64).exp()
}

macro_rules! sample {
    ($name:literal) => {
        (include_bytes!(concat!("../../../tests/records/", $name)).as_slice(), $name)
    };
}

fn text(sample: (&[u8], &str)) -> String {
    String::from_utf8(sample.0.to_vec()).unwrap()
}

fn message(content: impl AsRef<[u8]>, name: &str) -> String {
    parse(content.as_ref(), name).unwrap_err().to_string()
}

/// Compares a record with the twelve points times `factor`, within `tolerance` in g.
fn check(record: &Record, dt: f64, factor: f64, tolerance: f64) {
    assert_eq!(record.dt, dt, "{}", record.name);
    assert_eq!(record.acceleration.len(), 12, "{}", record.name);
    for (i, a) in record.acceleration.iter().enumerate() {
        let expected = factor * point(i) * STANDARD_GRAVITY;
        assert!((a - expected).abs() < tolerance * STANDARD_GRAVITY, "{}: {a} at {i}", record.name);
    }
}

#[test]
fn every_format_holds_the_same_motion() {
    for ((bytes, name), tolerance) in [
        (sample!("nga.AT2"), 1e-7),
        (sample!("older.at2"), 1e-7),
        (sample!("oldest.at2"), 1e-7),
        (sample!("stuck.at2"), 1e-6),
        (sample!("headerless.at2"), 1e-6),
        (sample!("csmip.v2"), 1e-8),
        (sample!("one_column.csv"), 1e-8),
        (sample!("two_columns.csv"), 1e-6),
        (sample!("european.csv"), 1e-6),
    ] {
        check(&parse(bytes, name).unwrap(), 0.01, 1.0, tolerance);
    }
    let (bytes, name) = sample!("cosmos.v2c");
    check(&parse(bytes, name).unwrap(), 0.005, 5.0, 1e-6);
}

#[test]
fn the_content_decides_the_format() {
    for (bytes, _) in [sample!("nga.AT2"), sample!("csmip.v2"), sample!("two_columns.csv")] {
        for name in ["a.at2", "a.v2", "a.csv", "a", ""] {
            check(&parse(bytes, name).unwrap(), 0.01, 1.0, 1e-6);
        }
    }
}

#[test]
fn records_are_named_by_their_files() {
    let name = |(bytes, file)| parse(bytes, file).unwrap().name;
    assert_eq!(name(sample!("nga.AT2")), "Made-up Event, 1/2/2003, Some Station, 180");
    assert_eq!(name(sample!("csmip.v2")), "Madeup - 1 Some St., Chan 1: 180 Deg");
    assert_eq!(name(sample!("cosmos.v2c")), "XX-00000 XYZ Some Station, Chan 1: 90 deg");
    assert_eq!(name(sample!("two_columns.csv")), "two_columns");
}

#[test]
fn several_channels_need_a_choice() {
    let (bytes, name) = sample!("csmip_three.V2");
    let text = message(bytes, name);
    assert!(text.contains("1 (Madeup - 1 Some St., Chan 1: 180 Deg), 2 ("), "{text}");
    for (channel, factor) in [(1, 1.0), (2, 0.5), (3, -1.0)] {
        let options = ReadOptions { channel: Some(channel), ..ReadOptions::default() };
        check(&parse_with(bytes, name, &options).unwrap(), 0.01, factor, 1e-8);
    }
    let options = ReadOptions { channel: Some(4), ..ReadOptions::default() };
    assert!(parse_with(bytes, name, &options).unwrap_err().to_string().contains("channel = 4"));
}

#[test]
fn a_wrong_count_names_both_numbers() {
    for (content, both) in [
        (text(sample!("nga.AT2")).replace("     12,", "   5372,"), "line 4: NPTS is 5372, but 12 values"),
        (text(sample!("oldest.at2")).replace("   12 ", "   11 "), "line 4: NPTS is 11, but 12 values"),
        (
            text(sample!("csmip.v2")).replace("    12 points of accel", "1000000000 points of accel"),
            "line 44: 1000000000 points are declared, but 12 values",
        ),
        (
            text(sample!("cosmos.v2c")).replace("12 acceleration pts", "13 acceleration pts"),
            "13 points are declared, but 12 values",
        ),
        (
            text(sample!("two_columns.csv")).replace("npts=12", "npts=1000000000"),
            "line 1: npts is 1000000000, but 12 values",
        ),
    ] {
        let text = message(&content, "x");
        assert!(text.contains(both), "{text}");
    }
    let truncated = text(sample!("nga.AT2"));
    assert!(message(&truncated[..truncated.len() - 40], "x").contains("NPTS is 12, but 10 values"));
    let truncated = text(sample!("csmip.v2"));
    let half = truncated.find(" points of veloc").unwrap() - 30;
    assert!(message(&truncated[..half], "x").contains("12 points are declared, but 1"));
}

#[test]
fn a_time_step_in_another_unit_is_refused() {
    let nga = text(sample!("nga.AT2"));
    let line = nga.lines().find(|line| line.contains("NPTS")).unwrap();
    for (step, allowed) in
        [("10 MSEC", false), ("10. ms", false), ("10MSEC", false), (".01 SEC", true), (".01SEC", true)]
    {
        let answer = parse(nga.replacen(line, &format!("NPTS= 12, DT= {step},"), 1).as_bytes(), "x.at2");
        match answer {
            Ok(record) => assert!(allowed && record.dt == 0.01, "{step}: {}", record.dt),
            Err(error) => assert!(!allowed && error.to_string().contains("must be in s"), "{step}: {error}"),
        }
    }
}

#[test]
fn bad_values_name_their_line() {
    let nga = text(sample!("nga.AT2"));
    for bad in ["            NaN", "            Inf", "***************", "      .1000E+99"] {
        let spoilt = nga.replacen("   .2126350E+00", bad, 1);
        let answer = parse(spoilt.as_bytes(), "x.at2");
        if bad.contains("E+99") {
            assert!(answer.is_ok(), "large, but a number");
        } else {
            let text = answer.unwrap_err().to_string();
            assert!(text.starts_with("x.at2: line 5: `"), "{text}");
        }
    }
    let csv = text(sample!("two_columns.csv"));
    assert!(message(csv.replace("0.0300,", "0.0300,nan"), "x").contains("line 6: column 2"));
    assert!(message(csv.replace("0.0300,", "0.0340,"), "x").contains("line 6: time is 0.034"));
    assert!(message(csv.replace("0.0300,", "0.0300,1,"), "x").contains("line 6: 3 columns"));
    let csmip = text(sample!("csmip.v2"));
    let at = csmip.find("   0.00000").unwrap();
    assert!(message([&csmip[..at], "       NaN", &csmip[at + 10..]].concat(), "x").contains("line 45"));
}

#[test]
fn a_file_without_a_record_is_refused() {
    for (content, name, expected) in [
        (&b""[..], "x.csv", "is empty"),
        (b" \r\n\r\n\x1a", "x.at2", "is empty"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\r", "x.at2", "not a text file"),
        (b"<html><body>404</body></html>\n", "x.at2", "no line with NPTS"),
        (b"<html><body>404</body></html>\n", "x.v2", "no line announces"),
        (b"# only a comment\n", "x.csv", "no rows of numbers"),
        (b"1\n2\n3\n", "x.csv", "no time step"),
        (b"1 2 3 4 5\n", "x.at2", "no time step"),
        (b"t,v\n0,1\n0,2\n", "x.csv", "must increase"),
        (b"t_s,ag_g,az_g\n0,1,2\n", "x.csv", "2 columns look like acceleration"),
        (b"t_s,x,y\n0,1,2\n", "x.csv", "none of the columns is named as acceleration (t_s, x, y)"),
        (b"t_s,velocity\n0,1\n1,2\n", "x.csv", "`velocity` is not an acceleration"),
        (b"# dt = -0.01\n1\n", "x.csv", "line 1: dt = -0.01"),
        (b"# units: counts\n1\n", "x.csv", "`counts`"),
        (b"# dt = 100Hz\n1\n", "x.csv", "line 1: dt = 100Hz: `Hz` must be one of s, ms"),
        (b"# units = % g\n1\n", "x.csv", "`%`"),
        (b"%units: %g\n1\n", "x.csv", "`%g`"),
        (b"# dt=0.02\nt,a\n0,1\n0.01,2\n0.02,3\n", "x.csv", "states dt = 0.02 s, but its times are 0.01"),
        (b"x\ny\nUNITS OF CM\nNPTS= 1, DT= .01\n1\n", "x.at2", "line 3: `CM`"),
        (b"x\ny\nVELOCITY IN UNITS OF CM/S\nNPTS= 1, DT= .01\n1\n", "x.vt2", "holds velocity"),
        (b"NPTS= 0, DT= .01\n", "x", "NPTS must be a whole number above zero"),
        (b"NPTS= 99999999999999999999999, DT= .01\n1\n", "x", "NPTS must be a whole number"),
        (b"NPTS= 1, DT= 0\n1\n", "x", "DT = 0: must be positive"),
        (b"NPTS, DT\n1\n", "x", "a number for both"),
        (b"NPTS= 1, DT= .01\n1e308\n", "x", "every sample must be finite"),
    ] {
        let text = message(content, name);
        assert!(text.starts_with(name) && text.contains(expected), "{text}");
    }
}

#[test]
fn a_step_in_a_comment_has_its_unit() {
    for (comment, dt) in [
        ("dt = 0.02", 0.02),
        ("dt = 0.02s, npts = 2", 0.02),
        ("dt = 20 ms npts = 2", 0.02),
        ("dt = 500µs", 5e-4),
        ("dt: 0.5 min", 30.0),
        ("dt = 0.5min, npts = 2", 30.0),
        ("dt = 0.01 h", 36.0),
        // The extremes of the record.
        ("dt = 0.02 min = -1 max = 1", 0.02),
        ("dt = 0.02 of the digitizer", 0.02),
    ] {
        let record = parse(format!("# units = g, {comment}\n1\n-1\n").as_bytes(), "x.csv").unwrap();
        assert!((record.dt - dt).abs() < 1e-12 * dt, "{comment}: {}", record.dt);
    }
}

#[test]
fn a_message_quotes_only_a_short_part_of_the_file() {
    let rows = [",1".repeat(60), ",2".repeat(60)].map(|row| format!("0{row}\n")).concat();
    for name in ["quantity", "acc"] {
        let names: String = (0..60).map(|n| format!(",{name}_{n}_{}", "x".repeat(500))).collect();
        let text = message(format!("t{names}\n{rows}"), "x.csv");
        assert!(text.contains("acceleration") && text.len() < 600, "{text}");
    }
}

#[test]
fn the_caller_gives_what_the_file_omits() {
    let options = ReadOptions { dt: Some(0.02), unit: Some(Unit::GRAVITY), channel: None };
    let record = parse_with(b"0.1 0.2 0.3\n0.4\n", "rows.txt", &options).unwrap();
    assert_eq!((record.acceleration.len(), record.dt), (4, 0.02));
    assert_eq!(record.acceleration[3], 0.4 * STANDARD_GRAVITY);
    let at2 = ReadOptions { dt: Some(0.02), ..ReadOptions::default() };
    assert_eq!(parse_with(b"0.5\n", "rows.at2", &at2).unwrap().pga(), 0.5 * STANDARD_GRAVITY);
    let question = parse_with(b"0.5\n", "rows.txt", &at2).unwrap_err().to_string();
    assert!(question.contains("unit=\"g\"") && question.contains("cm/s2"), "{question}");
    let (bytes, name) = sample!("nga.AT2");
    let text = parse_with(bytes, name, &at2).unwrap_err().to_string();
    assert!(text.contains("0.01 s") && text.contains("0.02 s"), "{text}");
}

#[test]
fn a_unit_is_never_guessed() {
    for (content, column) in [
        ("0.00,0.1\n0.01,0.2\n", "column 2"),
        ("time,acc\n0.00,0.1\n0.01,0.2\n", "`acc`"),
        ("Time [s];Acceleration\n0,00;0,1\n0,01;0,2\n", "`Acceleration`"),
        ("# dt = 0.01\n0.1\n0.2\n", "the values"),
    ] {
        let text = message(content, "x.csv");
        assert!(text.starts_with("x.csv: ") && text.contains(column), "{text}");
        assert!(text.contains("unit=\"g\"") && text.contains("--unit g"), "{text}");
        let options = ReadOptions { unit: Some(Unit::GRAVITY), ..ReadOptions::default() };
        let record = parse_with(content.as_bytes(), "x.csv", &options).unwrap();
        assert_eq!(record.pga(), 0.2 * STANDARD_GRAVITY, "{content}");
    }
    for header in ["t,acc (g)", "t,Acceleration [g]", "t,a_g", "Time (s),Ground acceleration (g)"] {
        let record = parse(format!("{header}\n0.00,0.1\n0.01,0.2\n").as_bytes(), "x.csv").unwrap();
        assert_eq!(record.pga(), 0.2 * STANDARD_GRAVITY, "{header}");
    }
}

#[test]
fn the_unit_of_a_time_column_is_used_or_refused() {
    for (unit, factor) in
        [("s", 1.0), ("sec", 1.0), ("msec", 1e3), ("milliseconds", 1e3), ("us", 1e6), ("min", 1.0 / 60.0)]
    {
        for header in [format!("Time ({unit})"), format!("t_{unit}")] {
            let rows: String =
                (0..12).map(|i| format!("{},{}\n", 0.01 * factor * f64::from(i), i % 3)).collect();
            let record = parse(format!("{header},acc (g)\n{rows}").as_bytes(), "x.csv").unwrap();
            assert!((record.dt - 0.01).abs() < 1e-12, "{header}: {}", record.dt);
        }
    }
    let refused = message("Time (ns),acc (g)\n0,0\n1,1\n", "x.csv");
    assert!(
        refused.contains("line 1: unit `ns` of the time: must be one of s, ms, µs, us, min, h"),
        "{refused}"
    );
}

#[test]
fn a_unit_in_brackets_is_taken_as_a_whole() {
    for unit in ["% g", "mg", "milli g", "counts"] {
        let refused = message(format!("t,acc ({unit})\n0,0\n0.01,1\n"), "x.csv");
        assert!(refused.contains(&format!("`acc ({unit})` names no known unit: ")), "{unit}: {refused}");
    }
    for header in ["acc (g) filtered", "acc [NS] (g)", "acc (NS) g"] {
        let record = parse(format!("t,{header}\n0,0\n0.01,1\n").as_bytes(), "x.csv").unwrap();
        assert_eq!(record.pga(), STANDARD_GRAVITY, "{header}");
    }
}

#[test]
fn names_with_blanks_stand_over_columns_without_separators() {
    let one = parse(b"# dt = 0.01\nacceleration (g)\n0.1\n-0.2\n", "x.txt").unwrap();
    assert_eq!((one.pga(), one.acceleration.len()), (0.2 * STANDARD_GRAVITY, 2));
    let two = parse(b"  time (s)   acceleration (g)\n 0.00  0.1\n 0.01 -0.2\n", "x.txt").unwrap();
    assert_eq!((two.pga(), two.dt), (0.2 * STANDARD_GRAVITY, 0.01));
}

#[test]
fn decimal_commas_between_tabs_or_blanks_are_read() {
    for (text, count) in [
        ("time (s)\tacc (g)\n0,00\t0,1\n0,01\t-0,2\n", 2),
        ("# units = g\n0,00 0,1\n0,01 -0,2\n", 2),
        ("# units = g, dt = 0.01\n0,00 0,1 0\n0,01 -0,2 1E-2\n", 6),
        ("# units = g, dt = 0.01\n0,-0.2,0.1\n", 3),
        ("# units = g, dt = 0.01\n0, -0.2, 0.1\n", 3),
    ] {
        let record = parse(text.as_bytes(), "x.txt").unwrap();
        assert_eq!((record.pga(), record.acceleration.len()), (0.2 * STANDARD_GRAVITY, count), "{text}");
    }
}

#[test]
fn names_may_stand_below_a_preamble_and_above_their_units() {
    let rows = |separator: &str, step: f64| -> String {
        (0..12).map(|i| format!("{}{separator}{:.9}\n", step * f64::from(i), point(i as usize))).collect()
    };
    for (head, separator, step) in [
        ("Test 7 of the lab\nOperator: me\ntime (s),acceleration (g)\n", ",", 0.01),
        ("Date;12.3.2004\nSensor;7\n\nTime;Acceleration\nms;g\n", ";", 10.0),
        ("// by us\ntime\tacc\n(s)\t[g]\n", "\t", 0.01),
        ("Separator\tTab\nDelta_X\t0.01\t\nX_Value\tAcceleration (g)\tComment\n", "\t", 0.01),
    ] {
        check(
            &parse((head.to_owned() + &rows(separator, step)).as_bytes(), "a.csv").unwrap(),
            0.01,
            1.0,
            1e-6,
        );
    }
    let both = message("time (s);acc (g)\n0,00;0.5\n0,01;0.6\n", "a.csv");
    assert!(both.contains("line 2: both `.` and `,` in it; one must be the decimal mark"), "{both}");
    let date = parse(b"date;time (s);acc (g)\n12.3.2004;0,00;0,1\n12.3.2004;0,01;-0,2\n", "a.csv").unwrap();
    assert_eq!((date.pga(), date.dt), (0.2 * STANDARD_GRAVITY, 0.01));
}

#[test]
fn a_time_among_columns_without_names_is_no_acceleration() {
    let options = ReadOptions { dt: Some(0.01), unit: Some(Unit::GRAVITY), channel: None };
    let rows: String = (0..8).map(|i| format!("{} {} 0\n", 0.01 * f64::from(i), i % 3)).collect();
    let refused = parse_with(rows.as_bytes(), "x.txt", &options).unwrap_err().to_string();
    assert!(refused.contains("the first of 3 columns rises in every row"), "{refused}");
    let rows: String = (0..8).map(|i| format!("{} {} 0\n", 0.01 * f64::from(i % 7), i % 3)).collect();
    assert_eq!(parse_with(rows.as_bytes(), "x.txt", &options).unwrap().acceleration.len(), 24);
}

#[test]
fn a_gap_in_the_times_is_named_where_it_is() {
    let rows: String = (0..400)
        .map(|i| format!("{:.3},{}\n", 0.005 * f64::from(if i < 200 { i } else { i + 1 }), i % 3))
        .collect();
    let said = message(format!("time (s),acc (g)\n{rows}"), "x.csv");
    assert!(
        said.contains("line 202: time is 1.005, 1.0") && said.contains("must increase by even steps"),
        "{said}"
    );
}

#[test]
fn a_knet_record_is_its_counts_times_the_factor_less_their_mean() {
    let (bytes, name) = sample!("knet.NS");
    let record = parse(bytes, name).unwrap();
    assert_eq!((record.name.as_str(), record.dt, record.acceleration.len()), ("XXX001, N-S", 0.01, 100));
    // The header's own peak, in gal.
    assert!((record.pga() * 100.0 - 5.803).abs() < 5e-4, "{}", record.pga());
    assert!(record.acceleration.iter().sum::<f64>().abs() < 1e-12);
    for (from, to, says) in [
        ("Duration Time(s)  1", "Duration Time(s)  9", "900 values, 100 follow"),
        ("7845(gal)/8223790", "7845/8223790", "line 14: scale factor"),
        ("100Hz", "-1Hz", "line 11: sampling freq = -1"),
        ("Memo.", "Mem", "Memo."),
    ] {
        let text = message(text(sample!("knet.NS")).replace(from, to), name);
        assert!(text.contains(says), "{text}");
    }
}

#[test]
fn a_file_of_many_lines_is_refused() {
    let text = message("\n".repeat(MAX_LINES + 1) + "1\n", "x.csv");
    assert!(text.contains("750003 lines") && text.contains("750000"), "{text}");
}

#[test]
fn a_units_comment_may_omit_units_of_the_header() {
    let record = parse(b"# units: s, g\nt_s,a_g\n0,0.5\n0.1,0.25\n", "x.csv").unwrap();
    assert_eq!(record.pga(), 0.5 * STANDARD_GRAVITY);
    assert!(message("# units: s, g\n0,0.5\n0.1,0.25\n", "x.csv").contains("line 1: units `s`"));
    assert!(message("# units: g\nt_s,a_mps2\n0,0.5\n0.1,0.25\n", "x.csv").contains("different units"));
}

#[test]
fn missing_files_are_io_errors() {
    for path in ["/no/such/file.at2", "/"] {
        let error = read_record(path).unwrap_err();
        assert!(matches!(error, crate::Error::Io { .. }) && error.to_string().starts_with(path));
    }
}
