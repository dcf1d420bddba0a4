//! Lays out the header from cbindgen's output. It has sections, and constants and fields have their comments on the
//! same line. Double precision comes last, without comments.

use std::fmt::Write as _;

/// Widest line.
const WIDTH: usize = 120;

const SECTIONS: [&str; 7] = [
    "Version and return codes",
    "Status of a tick",
    "Parameters",
    "The tick",
    "The learner",
    "From one context to another, without a lock",
    "Double precision: as above",
];
const DOUBLE: usize = 6;

/// A declaration with its comment, lines without their indentation.
struct Item<'a> {
    comment: Vec<&'a str>,
    lines: Vec<String>,
}

impl<'a> Item<'a> {
    fn new(text: &'a str) -> Self {
        let lines: Vec<_> = text.lines().map(str::trim).collect();
        let (comment, lines) = lines.split_at(lines.iter().take_while(|l| l.starts_with("//")).count());
        // Only the declaration of a struct needs the keyword.
        let plain = |line: &&str| {
            if line.starts_with("typedef") { (*line).to_owned() } else { line.replace("struct eft_", "eft_") }
        };
        Self { comment: comment.to_vec(), lines: lines.iter().map(plain).collect() }
    }

    fn is_constant(&self) -> bool {
        self.lines[0].starts_with("#define")
    }

    /// The declared name.
    fn name(&self) -> &str {
        let first = self.lines[0].split('(').next().unwrap();
        let words: Vec<_> = first.split([' ', '*']).filter(|w| !w.is_empty() && *w != "{").collect();
        if self.is_constant() { words[1] } else { words.last().unwrap() }
    }

    fn section(&self, before: usize) -> usize {
        let is_of = |words: &[&str]| words.iter().any(|word| self.name().contains(word));
        match self.name() {
            name if name.ends_with("_f64") => DOUBLE,
            "EFT_ABI_VERSION" | "eft_abi_version" => 0,
            "EFT_NO_STEP" | "EFT_SPOOL_WARNING" => 1,
            "EFT_TABLE_CAPACITY" => 2,
            "EFT_CURVE_NODES" => 4,
            name if name.starts_with("EFT_") => before,
            "eft_parameters" | "eft_learning" | "eft_plausibility" | "eft_protection" | "eft_error" => 2,
            _ if is_of(&["channels", "windows", "calibrations", "offer", "take"]) => 5,
            _ if is_of(&[
                "learn",
                "read_calibration",
                "found_flow",
                "save",
                "start_from",
                "first_calibration",
            ]) =>
            {
                4
            }
            _ => 3,
        }
    }

    /// A struct whose fields have no comments.
    fn is_one_line(&self) -> bool {
        self.lines[0].starts_with("typedef") && !self.lines.iter().any(|line| line.starts_with("//"))
    }

    /// The comment; for a constant only its first paragraph, because it is on one line.
    fn comment(&self) -> String {
        let words = self.comment.iter().map(|line| text(line));
        words.take_while(|line| !(self.is_constant() && line.is_empty())).collect::<Vec<_>>().join(" ")
    }

    fn write(&self, out: &mut String, commented: bool) {
        let is_comment = |line: &&String| line.starts_with("//");
        let bare: Vec<_> = self.lines.iter().filter(|line| !is_comment(line)).map(String::as_str).collect();
        let (bare, comment) = (bare.join(" "), self.comment());
        if self.is_constant() || commented && self.is_one_line() && bare.len() + comment.len() < WIDTH - 3 {
            return writeln!(out, "{}", with_comment(&bare, &comment)).unwrap();
        }
        if commented && !comment.is_empty() {
            fill(out, ["// ", "// "], comment.split_inclusive(' '));
        }
        if !commented || !self.lines.iter().any(|line| is_comment(&line)) {
            return fill(out, ["", "    "], bare.split_inclusive([',', ';']));
        }
        // A struct: all lines except the first and the last are fields. Each has its comment's first paragraph.
        let (mut comment, last) = (Vec::new(), self.lines.len() - 1);
        for (n, line) in self.lines.iter().enumerate() {
            match line {
                line if is_comment(&line) => comment.push(text(line)),
                line if n == 0 || n == last => writeln!(out, "{line}").unwrap(),
                line => {
                    let paragraph: Vec<_> = comment.drain(..).take_while(|words| !words.is_empty()).collect();
                    writeln!(out, "  {}", with_comment(line, &paragraph.join(" "))).unwrap();
                }
            }
        }
    }
}

/// The words of a comment's line.
fn text(line: &str) -> &str {
    line.trim_start_matches('/').trim()
}

/// A declaration with its comment on the same line.
fn with_comment(line: &str, comment: &str) -> String {
    if comment.is_empty() { line.to_owned() } else { format!("{line:<34} // {comment}") }
}

/// Writes pieces on lines of the width. The first line starts with `first`, each further one with `others`.
fn fill<'a>(out: &mut String, [first, others]: [&str; 2], pieces: impl Iterator<Item = &'a str>) {
    let mut line = first.to_owned();
    for piece in pieces {
        if line.chars().count() + piece.trim_end().chars().count() > WIDTH {
            writeln!(out, "{}", line.trim_end()).unwrap();
            line = others.to_owned() + piece.trim_start();
        } else {
            line += piece;
        }
    }
    writeln!(out, "{}", line.trim_end()).unwrap();
}

/// cbindgen's items with the names of C: constants for the core's flags and causes, and one name for each exchange.
fn as_in_c(items: &str) -> String {
    let (before, rest) = items.split_once("// What tripped a protection first.\nenum CAUSE").unwrap();
    let (causes, rest) = rest.split_once("\n};").unwrap();
    let (_, after) = rest.split_once("\n\n").unwrap();
    let mut out = before.to_owned();
    for line in causes.lines().map(str::trim) {
        match line.trim_end_matches(',').split_once(" = ") {
            Some((name, number)) => write!(out, "#define {name} {number}\n\n").unwrap(),
            None if line.starts_with("//") => writeln!(out, "{line}").unwrap(),
            None => {}
        }
    }
    out = (out + after).replace("#define EFT_", "#define ").replace("#define ", "#define EFT_");
    out = out
        .replace("(1 <<", "(1u <<")
        .replace("(31 << CAUSE", "(31u << EFT_CAUSE")
        .replace('`', "")
        .replace('²', "2");
    out = out.replace("Input_f", "eft_input_f");
    for item in ["channel", "window", "calibration"] {
        out = out.replace(&format!("eft_exchange_eft_{item}_"), &format!("eft_{item}s_"));
    }
    out
}

/// The whole header; `sizes` are the lines that assert the structs' sizes.
pub(crate) fn laid_out(raw: &str, sizes: &[String]) -> String {
    let (top, rest) = raw.split_once("@items\n").unwrap();
    let (items, end) = rest.split_once("@end\n").unwrap();
    let items = as_in_c(items);
    let mut sections: [Vec<Item>; SECTIONS.len()] = std::array::from_fn(|_| Vec::new());
    let mut section = 0;
    for text in items.split("\n\n").filter(|text| !text.trim().is_empty()) {
        let item = Item::new(text.trim());
        section = item.section(section);
        sections[section].push(item);
    }
    let mut out = top.to_owned();
    for (n, (title, items)) in SECTIONS.iter().zip(&sections).enumerate() {
        write!(out, "\n/* ---------- {title} ---------- */\n\n").unwrap();
        let (mut before, mut said) = (None::<&Item>, String::new());
        for item in items {
            if before.is_some_and(|b| {
                n != DOUBLE && !item.is_constant() && !(b.is_one_line() && item.is_one_line())
            }) {
                out.push('\n');
            }
            // The types of one generic type share its comment.
            item.write(&mut out, n != DOUBLE && item.comment() != said);
            (before, said) = (Some(item), item.comment());
        }
    }
    write!(out, "\n/* ---------- Sizes, as the library has them ---------- */\n\n").unwrap();
    for line in sizes {
        writeln!(out, "{line}").unwrap();
    }
    writeln!(out, "{end}").unwrap();
    let wide: Vec<_> = out.lines().filter(|line| line.chars().count() > WIDTH).collect();
    assert!(wide.is_empty(), "wider than {WIDTH}: {wide:#?}");
    out
}
