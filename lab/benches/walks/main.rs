//! Scores the tracker on recorded walks of real people: docs/lab/real-walks.md.
//!
//!     walks DATA [--json] [--noisy] [--place] [--own] [--settings JSON] [--names WORDS]
//!
//! A row is a sequence at its own rate or at fewer frames per second. `--noisy` gives the boxes of
//! FRIDA the errors of a detector, `--place` places its cameras by the people, `--own` leaves out
//! the other rates, `--names` all names without one of the words.

mod data;
mod frida;
mod lines;
mod scores;
mod view;

use std::{
    env,
    path::PathBuf,
    slice,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
};

use anyhow::{Context, Result, bail};
use lookdown_tracking::{
    CameraPose, Observation, Tracker, TrackerSettings,
    lines::{LineCounter, LineState},
    taught::{CrossingRatio, ReferenceCrossings},
};
use serde_json::{Value, json};

use data::{Frame, Rectangle, Sequence};
use lines::{Crossings, Event};
use scores::{Step, Sums, rounded};
use view::{View, overlap};

/// Rates beside the own one, frames per second.
const RATES: [f64; 3] = [5.0, 2.0, 1.0];

#[expect(clippy::struct_excessive_bools, reason = "flags of the command line")]
struct Options {
    data: PathBuf,
    is_json: bool,
    is_noisy: bool,
    places: bool,
    own_rate: bool,
    names: Vec<String>,
    settings: TrackerSettings,
}

/// A scored row.
pub struct Row {
    set: &'static str,
    name: String,
    rate: Value,
    sums: Sums,
    number: Number,
    frames_per_s: f64,
    /// True, counted and right crossings of lines in the frame; none for FRIDA.
    crossings: [usize; 3],
    /// The crossings of both halves of the time for each line.
    halves: Vec<[ReferenceCrossings; 2]>,
}

/// The number of tracks beside that of people, frame by frame.
#[derive(Default)]
pub struct Number {
    frames: usize,
    errors: usize,
    changes: usize,
    last: Option<usize>,
}

impl Number {
    /// Adds a frame.
    pub fn add(&mut self, people: usize, tracks: usize) {
        self.frames += 1;
        self.errors += people.abs_diff(tracks);
        self.changes += usize::from(self.last.is_some_and(|last| last != tracks));
        self.last = Some(tracks);
    }
}

fn quotient(one: usize, other: usize) -> f64 {
    one as f64 / other.max(1) as f64
}

fn options() -> Result<Options> {
    let mut data = None;
    let mut options = Options {
        data: PathBuf::new(),
        is_json: false,
        is_noisy: false,
        places: false,
        own_rate: false,
        names: Vec::new(),
        settings: TrackerSettings::default(),
    };
    let mut arguments = env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || {
            arguments
                .next()
                .with_context(|| format!("{argument} needs a value"))
        };
        match argument.as_str() {
            "--json" => options.is_json = true,
            "--noisy" => options.is_noisy = true,
            "--place" => options.places = true,
            "--own" => options.own_rate = true,
            "--names" => options.names = value()?.split(' ').map(str::to_owned).collect(),
            "--settings" => {
                let mut settings = serde_json::to_value(TrackerSettings::default())?;
                merge(&mut settings, &serde_json::from_str(&value()?)?);
                options.settings = serde_json::from_value(settings)?;
            }
            path if data.is_none() && !path.starts_with("--") => data = Some(PathBuf::from(path)),
            other => bail!("{other} is not an option"),
        }
    }
    options.data = data.context("give the folder of the data")?;
    Ok(options)
}

/// Replaces the values of an object by those of another, at any depth.
fn merge(base: &mut Value, over: &Value) {
    match (base, over) {
        (Value::Object(base), Value::Object(over)) => {
            for (key, value) in over {
                merge(base.entry(key.clone()).or_insert(Value::Null), value);
            }
        }
        (base, over) => *base = over.clone(),
    }
}

/// The persons of a frame with the numbers of their boxes.
pub fn persons(view: &View, frame: &Frame) -> (Vec<usize>, Vec<Observation>) {
    let seen = frame.found.iter().enumerate();
    let persons = seen
        .filter_map(|(at, (rectangle, score))| Some((at, view.observation(rectangle, *score)?)));
    persons.unzip()
}

/// The tracks that a camera's frame continued, with the numbers of their boxes.
pub(crate) fn continued(
    tracker: &Tracker,
    camera: usize,
    at_s: f64,
    boxes: &[usize],
) -> Result<Vec<(i64, usize)>> {
    let mut continued = Vec::new();
    for track in tracker.tracks().filter(|track| track.counts()) {
        let last = track.last_person;
        if track.seen_s == at_s && last.camera == camera {
            continued.push((
                serde_json::to_value(track.id)?.as_i64().unwrap_or_default(),
                boxes[last.person],
            ));
        }
    }
    Ok(continued)
}

fn follow(
    set: &'static str,
    sequence: &Sequence,
    rate: Option<f64>,
    settings: &TrackerSettings,
) -> Result<Row> {
    let circle = &sequence.circle;
    let view = View::new(circle, sequence.frames.iter())?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a few frames"
    )]
    let step = rate.map_or(1, |rate| (circle.frames_per_s / rate).round() as usize);
    let frames_per_s = circle.frames_per_s / quotient(step, 1);
    let pose = CameraPose::alone(Some(view.height_m));
    let mut tracker = Tracker::new(&[pose], *settings)?;
    let crossings = Crossings::new(sequence, &view);
    let mut counter = LineCounter::new(crossings.lines.clone(), LineState::default());
    let annotated = |frame: &Frame| !frame.truth.is_empty();
    let first = sequence.frames.iter().position(annotated).unwrap_or(0);
    let last = sequence.frames.iter().rposition(annotated).unwrap_or(0);
    let (mut steps, mut number) = (Vec::new(), Number::default());
    let mut passed: Vec<Event> = Vec::new();
    for (at, frame) in sequence.frames.iter().enumerate().step_by(step) {
        let at_s = f64::from(frame.number) / circle.frames_per_s;
        let (boxes, persons) = persons(&view, frame);
        tracker.update(f64::INFINITY, 0, at_s, &persons)?;
        let crossed = counter.update(tracker.tracks()).into_iter();
        passed.extend(crossed.map(|one| (one.line, lines::sign(one.direction), one.at_s)));
        let tracks = continued(&tracker, 0, at_s, &boxes)?;
        steps.push(step_of(frame, &tracks));
        if (first..=last).contains(&at) {
            number.add(frame.truth.len(), counting(&tracker));
        }
    }
    let right = crossings.matched(&passed, frames_per_s);
    let frames = quotient(sequence.frames.len(), 1);
    let middle_s = frames / (2.0 * circle.frames_per_s);
    Ok(Row {
        set,
        name: sequence.name.clone(),
        rate: rate.map_or_else(|| json!("own"), |rate| json!(rate)),
        sums: Sums::new(&steps),
        number,
        frames_per_s,
        crossings: [crossings.truth.len(), passed.len(), right],
        halves: crossings.halves(&passed, middle_s),
    })
}

/// Returns the number of tracks that count.
pub fn counting(tracker: &Tracker) -> usize {
    tracker.tracks().filter(|track| track.counts()).count()
}

/// The identities of a frame beside its tracks.
pub fn step_of(frame: &Frame, tracks: &[(i64, usize)]) -> Step {
    let overlaps = |(rectangle, _): &(Rectangle, i64)| {
        let boxes = tracks.iter().map(|(_, at)| &frame.found[*at].0);
        boxes.map(|found| overlap(rectangle, found)).collect()
    };
    Step {
        truth: frame.truth.iter().map(|(_, id)| *id).collect(),
        tracks: tracks.iter().map(|(track, _)| *track).collect(),
        similarity: frame.truth.iter().map(overlaps).collect(),
    }
}

impl Row {
    fn figures(&self) -> Value {
        let mut figures = self.sums.figures();
        let changes = 60.0 * self.frames_per_s * quotient(self.number.changes, self.number.frames);
        let [truth, counted, right] = self.crossings;
        let own = json!({
            "set": self.set,
            "name": self.name,
            "rate": self.rate,
            "number_error": rounded(quotient(self.number.errors, self.number.frames)),
            "changes_per_minute": rounded(changes),
            "crossings": {"true": truth, "counted": counted, "right": right},
        });
        merge(&mut figures, &own);
        figures
    }

    fn print(&self) {
        let figures = self.figures();
        let published = &figures["published"];
        let number = |value: &Value| value.as_f64().unwrap_or_default();
        let mut cells = vec![
            self.set.to_owned(),
            self.name.clone(),
            self.rate.to_string(),
        ];
        for (of, name) in [(&figures, "hota"), (&figures, "idf1"), (&figures, "mota")] {
            cells.push(format!("{:.3}", number(&of[name])));
        }
        cells.push(figures["switches"].to_string());
        for name in ["hota", "idf1", "mota"] {
            cells.push(format!("{:.3}", number(&published[name])));
        }
        cells.push(format!("{:.2}", number(&figures["number_error"])));
        cells.push(format!("{:.1}", number(&figures["changes_per_minute"])));
        let [truth, counted, right] = self.crossings;
        cells.push(format!(
            "{:.2}/{:.2} of {truth}",
            quotient(right, truth),
            quotient(right, counted)
        ));
        println!("| {} |", cells.join(" | "));
    }
}

/// The rows of each set and rate in one: scores over all frames, the means of the numbers.
fn print_sums(rows: &[Row]) {
    let mut kinds: Vec<(&str, &Value)> = Vec::new();
    for row in rows {
        if !kinds.contains(&(row.set, &row.rate)) {
            kinds.push((row.set, &row.rate));
        }
    }
    for (set, rate) in kinds {
        let own: Vec<&Row> = rows
            .iter()
            .filter(|row| (row.set, &row.rate) == (set, rate))
            .collect();
        let mut sums = Sums::default();
        let mut crossings = [0; 3];
        let (mut error, mut changes) = (0.0, 0.0);
        for row in &own {
            sums.add(&row.sums);
            crossings = [0, 1, 2].map(|at| crossings[at] + row.crossings[at]);
            error += quotient(row.number.errors, row.number.frames);
            changes += 60.0 * row.frames_per_s * quotient(row.number.changes, row.number.frames);
        }
        let figures = sums.figures();
        let published = &figures["published"];
        let count = quotient(own.len(), 1);
        let [truth, counted, right] = crossings;
        println!(
            "| {set} | all {} | {rate} | {} | {} | {} | {} | {} | {} | {} | {:.2} | {:.1} | {:.2}/{:.2} of {truth} |",
            own.len(),
            figures["hota"],
            figures["idf1"],
            figures["mota"],
            figures["switches"],
            published["hota"],
            published["idf1"],
            published["mota"],
            error / count,
            changes / count,
            quotient(right, truth),
            quotient(right, counted),
        );
    }
}

/// The numbers of crossings in one half of the time with their bars, untaught and taught by the
/// other half.
fn print_taught(rows: &[Row]) {
    for teaches in [false, true] {
        let (mut lines, mut off, mut held, mut width) = (0, 0.0, 0, 0);
        for [first, second] in rows.iter().flat_map(|row| &row.halves) {
            for [told, asked] in [[first, second], [second, first]] {
                let times = if teaches { slice::from_ref(told) } else { &[] };
                let number = CrossingRatio::new(times).number(asked.counted);
                lines += 1;
                off += (number.persons as f64 - asked.given as f64).abs();
                held +=
                    usize::from((number.low as u64..=number.high as u64).contains(&asked.given));
                width += number.high - number.low;
            }
        }
        let taught = if teaches {
            "taught by the other half"
        } else {
            "untaught"
        };
        println!(
            "crossings of {lines} halves of lines, {taught}: {:.2} off, {:.1} % in the bar, {:.1} wide",
            off / quotient(lines, 1),
            100.0 * quotient(held, lines),
            quotient(width, lines)
        );
    }
}

fn main() -> Result<()> {
    let options = options()?;
    let is_named = |name: &str| {
        options.names.is_empty() || options.names.iter().any(|word| name.contains(word))
    };
    let mut segments = data::segments(&options.data)?;
    let site = frida::Site::new(&segments)?;
    if options.is_noisy {
        frida::add_errors(&mut segments, &data::sequences(&options.data, "cepdof")?);
    }
    segments.retain(|segment| is_named(&segment.name));
    if options.places {
        return site.print_places(&segments, &options.settings);
    }
    let sets = ["cepdof", "wepdtof"].map(|set| (set, data::sequences(&options.data, set)));
    let mut jobs: Vec<Box<dyn Fn() -> Result<Row> + Sync + '_>> = Vec::new();
    for (set, sequences) in &sets {
        let sequences = sequences
            .as_ref()
            .map_err(|error| anyhow::anyhow!("{error:#}"))?;
        for sequence in sequences.iter().filter(|sequence| is_named(&sequence.name)) {
            jobs.push(Box::new(|| follow(set, sequence, None, &options.settings)));
            let slower = RATES
                .into_iter()
                .filter(|rate| *rate <= sequence.circle.frames_per_s / 1.5);
            for rate in slower.filter(|_| !options.own_rate) {
                jobs.push(Box::new(move || {
                    follow(set, sequence, Some(rate), &options.settings)
                }));
            }
        }
    }
    for segment in &segments {
        jobs.push(Box::new(|| site.follow(segment, &options.settings)));
    }
    let mut rows = all(&jobs)?;
    if options.is_json {
        for row in &rows {
            println!("{}", row.figures());
        }
        return Ok(());
    }
    println!(
        "| set | name | rate | HOTA | IDF1 | MOTA | switches | published HOTA | IDF1 | MOTA | number off | changes/min | crossings |"
    );
    println!("{}", "|---".repeat(13) + "|");
    rows.iter().for_each(Row::print);
    print_sums(&rows);
    rows.retain(|row| row.rate == json!("own"));
    print_taught(&rows);
    Ok(())
}

/// The rows of all jobs, in order, by as many threads as the machine has.
fn all(jobs: &[Box<dyn Fn() -> Result<Row> + Sync + '_>]) -> Result<Vec<Row>> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let at = next.fetch_add(1, Ordering::Relaxed);
                    let Some(job) = jobs.get(at) else { break };
                    let row = job();
                    if let Ok(mut done) = done.lock() {
                        done.push((at, row));
                    }
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, row)| row).collect()
}
