//! A search for inputs whose parsing takes more than linear time.
//!
//! Each recipe inserts one kind of filler into a calibration file: repeated, nested, numbered or
//! long. Each is grown by a factor of eight, and so may be its time, with a margin for noise. No
//! limit is absolute, so that the test holds on slow machines. `LOOKDOWN_COMPLEXITY=long` uses
//! every file, more positions and pairs of the slowest recipes at the size of the largest permitted
//! file, which may take one second in the release build.

use std::{collections::BTreeMap, env, fs, thread, time::Duration};

use lookdown_calibration::CalibrationFile;
use rustix::time::{ClockId, clock_gettime};

/// The factor between the two sizes of a file.
const GROWTH: usize = 8;
/// The largest permitted factor between the two times.
const MAX_RATIO: f64 = 16.0;
/// Shorter times are noise.
const LEAST: Duration = Duration::from_micros(500);
/// Measurements of a ratio that seems too large.
const ROUNDS: usize = 8;
/// Recipes of each file that the long form grows, alone and in pairs.
const GROWN: usize = 8;
/// Longest time of a file of the largest size in the long form.
const LONGEST: Duration = Duration::from_secs(1);

/// A kind of filler.
#[derive(Clone, Copy)]
enum Filler {
    /// A text, repeated.
    Repeated(&'static str),
    /// A text before and one after, both repeated equally often.
    Nested(&'static str, &'static str),
    /// A text with a counter in place of each `#`.
    Numbered(&'static str),
    /// Lines of which each is indented by one space more.
    Staircase(&'static str),
}

const FILLERS: [Filler; 58] = [
    Filler::Repeated("a"),
    Filler::Repeated("1"),
    Filler::Repeated("0"),
    Filler::Repeated(" "),
    Filler::Repeated("\n"),
    Filler::Repeated("\t"),
    Filler::Repeated("\r\n"),
    Filler::Repeated("é"),
    Filler::Repeated("1 "),
    Filler::Repeated("1,"),
    Filler::Repeated("1\n"),
    Filler::Repeated("-1.5e3, "),
    Filler::Repeated("["),
    Filler::Repeated("{"),
    Filler::Repeated("[1],"),
    Filler::Repeated("{},"),
    Filler::Repeated("\""),
    Filler::Repeated("'"),
    Filler::Repeated("''"),
    Filler::Repeated("\\u0041"),
    Filler::Repeated("\"\\n\","),
    Filler::Repeated("# a\n"),
    Filler::Repeated("- "),
    Filler::Repeated("- a\n"),
    Filler::Repeated("? "),
    Filler::Repeated("a: "),
    Filler::Repeated(":"),
    Filler::Repeated("a: |\n b\n"),
    Filler::Repeated("!!map "),
    Filler::Repeated("---\n"),
    Filler::Repeated("%YAML:1.0\n"),
    Filler::Repeated("*a, "),
    Filler::Repeated("<<: *a\n"),
    Filler::Repeated("&a "),
    Filler::Repeated("<a>"),
    Filler::Repeated("<a/>"),
    Filler::Repeated("<a b=\"c\"/>"),
    Filler::Repeated("<!-- a -->"),
    Filler::Repeated("&amp;"),
    Filler::Repeated("<![CDATA[1]]>"),
    Filler::Repeated("[[a]]\n"),
    Filler::Repeated("1 SIMPLE_RADIAL_FISHEYE 64 64 30 32 32 0\n"),
    Filler::Nested("[", "]"),
    Filler::Nested("{\"a\":", "}"),
    Filler::Nested("{a: ", "}"),
    Filler::Nested("<a>", "</a>"),
    Filler::Nested("\"a\":[", "],"),
    Filler::Numbered("\"k#\":#,"),
    Filler::Numbered("k#: #\n"),
    Filler::Numbered("k#: &k# [*k#]\n"),
    Filler::Numbered("k#=#\n"),
    Filler::Numbered("[k#]\n"),
    Filler::Numbered("a.b.k# = 1\n"),
    Filler::Numbered("<k#>#</k#>"),
    Filler::Numbered("# PINHOLE # # # # # #\n"),
    Filler::Numbered("[#, #],"),
    Filler::Numbered("{\"name\":\"z#\",\"floor_m\":[[0,0],[1,0],[1,#]]},"),
    Filler::Staircase("a:\n"),
];

impl Filler {
    fn text(self, bytes: usize) -> String {
        match self {
            Self::Repeated(text) => text.repeat(bytes / text.len()),
            Self::Nested(open, close) => {
                let depth = bytes / (open.len() + close.len());
                open.repeat(depth) + &close.repeat(depth)
            }
            Self::Numbered(text) => {
                let mut filler = String::with_capacity(bytes);
                for number in 0.. {
                    let next = text.replace('#', &number.to_string());
                    if filler.len() + next.len() > bytes {
                        break;
                    }
                    filler.push_str(&next);
                }
                filler
            }
            Self::Staircase(line) => {
                let mut filler = String::with_capacity(bytes);
                for depth in 0.. {
                    if filler.len() + depth + line.len() > bytes {
                        break;
                    }
                    filler.push_str(&" ".repeat(depth));
                    filler.push_str(line);
                }
                filler
            }
        }
    }
}

/// A file with fillers at some positions.
#[derive(Clone)]
struct Recipe {
    file: String,
    fillers: Vec<(usize, usize)>,
}

impl Recipe {
    /// Returns the content, which has about `bytes` of fillers.
    fn content(&self, bytes: usize) -> String {
        let bytes = bytes.min(CalibrationFile::MAX_BYTES - self.file.len());
        let each = bytes / self.fillers.len();
        let mut content = self.file.clone();
        // The last position first, so that the others stay valid.
        let mut fillers = self.fillers.clone();
        fillers.sort_unstable_by(|a, b| b.cmp(a));
        for (position, filler) in fillers {
            content.insert_str(position, &FILLERS[filler].text(each));
        }
        content
    }

    fn time(&self, bytes: usize) -> Duration {
        let content = self.content(bytes);
        let before = processor_time();
        if let Ok(file) = CalibrationFile::parse(content.as_bytes()) {
            assert!(!file.calibrations("x", content.as_bytes()).is_empty());
        }
        processor_time().saturating_sub(before)
    }

    /// Returns the ratio of the times of a large and a small file, each the smallest of a few.
    /// `small` is the time of a small file that was measured before.
    fn ratio(&self, mut small: Duration, bytes: usize) -> f64 {
        let mut large = Duration::MAX;
        for _ in 0..ROUNDS {
            large = large.min(self.time(bytes));
            if large.as_secs_f64() <= MAX_RATIO * small.max(LEAST).as_secs_f64() {
                break;
            }
            small = small.min(self.time(bytes / GROWTH));
        }
        large.as_secs_f64() / small.max(LEAST).as_secs_f64()
    }

    fn start(&self) -> String {
        self.content(100).chars().take(400).collect()
    }
}

/// Returns the time of the processor that this thread has used, which other programs do not change.
fn processor_time() -> Duration {
    Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).unwrap()
}

/// Returns positions of different kinds in a file: its start, and behind its middle line end,
/// colon, digit and so on.
fn positions(file: &str, is_long: bool) -> Vec<usize> {
    let wanted = ['\n', ':', '7', '[', '{', '"', '>'];
    let wanted = &wanted[..if is_long { wanted.len() } else { 4 }];
    let mut positions = vec![0];
    for &wanted in wanted {
        let found: Vec<_> = file.match_indices(wanted).map(|(at, _)| at + 1).collect();
        positions.extend(found.get(found.len() / 2));
    }
    positions.sort_unstable();
    positions.dedup();
    positions
}

/// A native file with zones and masks.
const ZONES: &str = r#"{ "id": "lobby", "image": {"width": 200, "height": 200},
  "lens": {"model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5, "max_theta": 1.5},
  "mount": {"world_up": [0, 0, -1], "height_m": 3},
  "zones": [{"name": "a", "frame_px": [[0,0], [100,0], [100,200]]},
    {"name": "b", "floor_m": [[0,0], [1,0], [1,1]]}],
  "masks": [{"frame_px": [[0,0], [100,0], [100,200]]}] }"#;

/// Returns one file of each format and syntax, or every file, with the name of its format.
fn files(is_long: bool) -> Vec<(String, String)> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/");
    let folders = ["tests/fixtures/calibrations", "samples/calibrations"];
    let zones = ("Native".to_owned(), ZONES.to_owned());
    let mut files = BTreeMap::from([("zones".to_owned(), zones)]);
    for folder in folders {
        for entry in fs::read_dir(format!("{root}{folder}")).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|ending| ending == "py") {
                continue;
            }
            let content = fs::read(&path).unwrap();
            if let Ok(file) = CalibrationFile::parse(&content) {
                let text = String::from_utf8(content).unwrap();
                // The same format in XML, YAML and JSON has different parsers.
                let syntax = text.trim_start().chars().next();
                let name = path.display().to_string();
                let key = format!(
                    "{:?} {syntax:?} {}",
                    file.format,
                    if is_long { &name } else { "" }
                );
                files.insert(key, (format!("{:?}", file.format), text));
            }
        }
    }
    files.into_values().collect()
}

/// Returns recipes with one filler each and their time at the smaller size, the slowest first.
fn recipes(file: &str, bytes: usize, is_long: bool) -> Vec<(Duration, Recipe)> {
    let mut recipes = Vec::new();
    for position in positions(file, is_long) {
        for filler in 0..FILLERS.len() {
            let recipe = Recipe {
                file: file.to_owned(),
                fillers: vec![(position, filler)],
            };
            recipes.push((recipe.time(bytes / GROWTH), recipe));
        }
    }
    recipes.sort_by_key(|(time, _)| std::cmp::Reverse(*time));
    recipes
}

#[test]
fn parsing_time_grows_linearly_with_the_file() {
    let bytes = CalibrationFile::MAX_BYTES / 64;
    let check = |file: &str| {
        for (small, recipe) in recipes(file, bytes, false) {
            let ratio = recipe.ratio(small, bytes);
            assert!(
                ratio <= MAX_RATIO,
                "the time grows by {ratio:.0} for {:?}: {}",
                recipe.fillers,
                recipe.start()
            );
        }
    };
    // Processor time is measured, which threads beside this one do not change.
    thread::scope(|scope| {
        for (_, file) in files(false) {
            scope.spawn(move || check(&file));
        }
    });
}

/// Runs with `LOOKDOWN_COMPLEXITY=long` only: one second is a limit of the release build.
#[test]
fn files_of_the_largest_size_are_parsed_within_a_second() {
    if env::var("LOOKDOWN_COMPLEXITY").is_ok_and(|form| form == "long") {
        let bytes = CalibrationFile::MAX_BYTES;
        let mut table = BTreeMap::<String, (usize, Duration, String)>::new();
        for (format, file) in files(true) {
            let singles = recipes(&file, bytes, true);
            let mut singles: Vec<_> = singles.into_iter().map(|(_, recipe)| recipe).collect();
            let row = table.entry(format).or_default();
            row.0 += singles.len();
            singles.truncate(GROWN);
            let pairs = singles.iter().enumerate().flat_map(|(index, one)| {
                singles[..index].iter().map(|other| {
                    let mut pair = one.clone();
                    pair.fillers.extend(other.fillers.iter().copied());
                    pair
                })
            });
            let pairs: Vec<_> = pairs.collect();
            for recipe in singles.iter().chain(&pairs) {
                let mut time = recipe.time(bytes);
                if time > row.1 {
                    // Other work on the machine delays single measurements.
                    time = time.min(recipe.time(bytes));
                }
                if time > row.1 {
                    (row.1, row.2) = (time, recipe.start());
                }
            }
            row.0 += pairs.len();
        }
        for (format, (tried, slowest, start)) in &table {
            let seconds = slowest.as_secs_f64();
            let start: String = start.chars().take(60).collect();
            println!("{format}: {tried} recipes, slowest {seconds:.3} s: {start:?}");
        }
        for (format, (_, slowest, start)) in table {
            assert!(slowest <= LONGEST, "{format}: {slowest:?} for {start}");
        }
    }
}
