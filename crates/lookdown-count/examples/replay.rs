//! Counts the reports of a clip again and again, as if its camera had gone on: the number of
//! persons of the first and the last round, and the crossings of all rounds.
//! `docs/lab/count-accuracy.md` has the command. With a fifth argument, a file, its store is kept,
//! so that `lookdown count CLIP --store FILE --annotate OUT.mp4` goes on from it.

use std::{error::Error, fs, path::PathBuf, sync::Arc, time::Duration};

use jiff::Timestamp;
use lookdown_calibration::CalibrationFile;
use lookdown_count::Recording;

/// Longest time between two reports that is known.
const LONGEST_GAP: Duration = Duration::from_secs(10);
/// Time of the first report, milliseconds since the Unix epoch.
const START_MS: i64 = 1_795_262_400_000;
/// Reports of a round that are not shown: tracks begin.
const BEGIN: usize = 25;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [reports, calibration, interval_ms, rounds, kept @ ..] = arguments.as_slice() else {
        return Err("replay REPORTS.jsonl CALIBRATION.json INTERVAL_MS ROUNDS [STORE]".into());
    };
    let (interval_ms, rounds) = (interval_ms.parse::<i64>()?, rounds.parse::<usize>()?);
    let reports = fs::read_to_string(reports)?;
    let reports: Vec<&str> = reports.lines().collect();
    let content = fs::read(calibration)?;
    let file = CalibrationFile::parse(&content)?;
    let (id, calibration) = file.calibrations("replay", &content).remove(0);
    let calibration = Some(Arc::new(calibration?));
    let folder = tempfile::tempdir()?;
    let temporary = || folder.path().join("counts.sqlite");
    let store = kept.first().map_or_else(temporary, PathBuf::from);
    let mut recording = Recording::open(&store, LONGEST_GAP, &id, calibration)?;
    let mut at_ms = START_MS;
    for round in 1..=rounds {
        let mut persons = Vec::new();
        for report in &reports {
            recording.count(Timestamp::from_millisecond(at_ms)?, report.as_bytes())?;
            persons.push(recording.persons());
            at_ms += interval_ms;
        }
        if round == 1 || round == rounds {
            show(round, persons.get(BEGIN..).unwrap_or_default());
        }
    }
    recording.commit()?;
    for line in recording.lines() {
        println!("{} {}: {}", line.line, line.direction, line.crossings);
    }
    Ok(())
}

/// Prints mean, standard deviation and range.
#[expect(clippy::cast_precision_loss, reason = "numbers of persons are small")]
fn show(round: usize, persons: &[u64]) {
    let count = persons.len().max(1) as f64;
    let mean = persons.iter().sum::<u64>() as f64 / count;
    let squares = persons.iter().map(|value| (*value as f64 - mean).powi(2));
    let deviation = (squares.sum::<f64>() / count).sqrt();
    let (least, most) = (persons.iter().min(), persons.iter().max());
    let (least, most) = (least.unwrap_or(&0), most.unwrap_or(&0));
    println!("round {round}: {mean:.1} ± {deviation:.1}, {least} to {most}");
}
