//! The recorded sequences: boxes with scores, and the truth with identities.

use std::{
    collections::BTreeMap,
    fs,
    io::Read,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result};
use flate2::read::GzDecoder;
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::Value;

/// Center, width, height in pixels of the frame, and the clockwise angle in degrees.
pub type Rectangle = [f64; 5];

/// Boxes below this score are not read.
const LEAST_SCORE: f64 = 0.02;
/// The score of boxes by people.
const HUMAN_SCORE: f64 = 0.95;

/// The lens circle of a sequence, equidistant over 180°, and its rate.
#[derive(Clone, Copy, Deserialize)]
pub struct Circle {
    pub center: [f64; 2],
    pub radius: f64,
    pub frames_per_s: f64,
}

/// One frame of one camera.
#[derive(Clone, Default)]
pub struct Frame {
    pub number: u32,
    pub found: Vec<(Rectangle, f64)>,
    pub truth: Vec<(Rectangle, i64)>,
}

/// The frames of one camera, in order.
pub struct Sequence {
    pub name: String,
    pub circle: Circle,
    pub frames: Vec<Frame>,
}

/// The three synchronous cameras of a segment of FRIDA.
pub struct Segment {
    pub name: String,
    pub cameras: Vec<Sequence>,
}

#[derive(Deserialize)]
struct Entry {
    img_name: String,
    bboxes: Vec<Rectangle>,
    #[serde(default)]
    scores: Vec<f64>,
    #[serde(default)]
    id: Vec<Value>,
}

impl Entry {
    fn number(&self) -> Result<u32> {
        let digits = self.img_name.rsplit('_').next().unwrap_or_default();
        digits
            .parse()
            .with_context(|| format!("the frame {} has no number", self.img_name))
    }
}

fn read<T: DeserializeOwned>(path: &Path) -> Result<T> {
    let bytes = fs::read(path).with_context(|| path.display().to_string())?;
    let mut text = Vec::new();
    if path.extension().is_some_and(|extension| extension == "gz") {
        GzDecoder::new(bytes.as_slice()).read_to_end(&mut text)?;
    } else {
        text = bytes;
    }
    serde_json::from_slice(&text).with_context(|| path.display().to_string())
}

/// The files of a folder with the names of their sequences.
fn files(folder: &Path) -> Result<BTreeMap<String, PathBuf>> {
    let mut files = BTreeMap::new();
    let listing = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    for entry in listing {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if let Some((name, "json.gz" | "json")) = name.split_once('.') {
            files.insert(name.to_owned(), path.clone());
        }
    }
    Ok(files)
}

fn circles(data: &Path) -> Result<BTreeMap<String, Circle>> {
    read(&data.join("cameras.json"))
}

fn frames(truth: &Path, detections: Option<&Path>) -> Result<Vec<Frame>> {
    let mut frames: BTreeMap<u32, Frame> = BTreeMap::new();
    let truth: Vec<Entry> = read(truth)?;
    for entry in truth {
        let frame = frames.entry(entry.number()?).or_default();
        let ids = entry.id.iter().map(|id| id.as_i64().unwrap_or_default());
        frame.truth.extend(entry.bboxes.iter().copied().zip(ids));
    }
    let found: Vec<Entry> = detections.map(read).transpose()?.unwrap_or_default();
    for entry in found {
        let frame = frames.entry(entry.number()?).or_default();
        let boxes = entry.bboxes.into_iter().zip(entry.scores);
        frame
            .found
            .extend(boxes.filter(|(_, score)| *score >= LEAST_SCORE));
    }
    let (first, last) = (frames.keys().next().copied(), frames.keys().last().copied());
    let numbers = first.unwrap_or(1)..=last.unwrap_or(0);
    let filled = numbers.map(|number| Frame {
        number,
        ..frames.remove(&number).unwrap_or_default()
    });
    Ok(filled.collect())
}

/// The sequences of a set with truth and detections.
pub fn sequences(data: &Path, set: &str) -> Result<Vec<Sequence>> {
    let circles = circles(data)?;
    let truth = files(&data.join("truth").join(set))?;
    let mut sequences = Vec::new();
    for (name, path) in files(&data.join("detections").join(set))? {
        let Some(truth) = truth.get(&name) else {
            continue;
        };
        sequences.push(Sequence {
            circle: *circles
                .get(&name)
                .with_context(|| format!("no circle of {name}"))?,
            frames: frames(truth, Some(&path))?,
            name,
        });
    }
    Ok(sequences)
}

/// The segments of FRIDA, with the truth as detections.
pub fn segments(data: &Path) -> Result<Vec<Segment>> {
    let circles = circles(data)?;
    let mut segments: BTreeMap<String, Vec<Sequence>> = BTreeMap::new();
    for (name, path) in files(&data.join("truth/frida"))? {
        let (segment, _) = name
            .split_once('_')
            .context("a file of FRIDA is segment_camera")?;
        let mut frames = frames(&path, None)?;
        for frame in &mut frames {
            let truth = frame.truth.iter();
            frame.found = truth
                .map(|(rectangle, _)| (*rectangle, HUMAN_SCORE))
                .collect();
        }
        segments
            .entry(segment.to_owned())
            .or_default()
            .push(Sequence {
                circle: *circles
                    .get(&name)
                    .with_context(|| format!("no circle of {name}"))?,
                frames,
                name,
            });
    }
    let segments = segments.into_iter();
    Ok(segments
        .map(|(name, cameras)| Segment { name, cameras })
        .collect())
}
