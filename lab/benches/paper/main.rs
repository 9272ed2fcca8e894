//! Repeats the paper's sweeps over its parameters, and plots precision over recall.
//!
//!     paper sweep DATASET FOLDER
//!     paper plot DATASET OUT.svg DETECTIONS.json...

mod plot;
mod sweep;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use clap::Parser;
use lookdown::{app::engine_for, settings};
use lookdown_detect::parameters::DetectParameters;
use lookdown_eval::{DataSet, DetectedRow, detect};

use plot::precision_recall_plot;

/// Repeats the paper's sweeps, and plots precision over recall
#[derive(Parser)]
enum Command {
    /// Write `cells.csv` (AP of NMS and Soft-NMS over `N_t` from 0 to 1, of Gaussian Soft-NMS over
    /// `C_t` and sigma) and `iou_threshold.svg` (AP over `N_t`)
    Sweep {
        /// A data set of `lookdown eval`
        data_set: PathBuf,
        /// The folder of the results
        folder: PathBuf,
        /// Trade-off between accuracy and cost
        #[arg(long, default_value = "paper")]
        profile: String,
        /// Ignore persons with a lower score, 0 to 1
        #[arg(long, default_value = "0.001")]
        score_threshold: String,
    },
    /// Plot the detections of `lookdown eval --save-detections`
    Plot {
        /// A data set of `lookdown eval`
        data_set: PathBuf,
        /// An .svg or a .png file
        plot: PathBuf,
        /// COCO results, a file per line of the plot
        #[arg(required = true)]
        detections: Vec<PathBuf>,
    },
}

fn main() -> anyhow::Result<()> {
    match Command::parse() {
        Command::Sweep {
            data_set,
            folder,
            profile,
            score_threshold,
        } => {
            let base = [
                ("profile", profile.as_str()),
                ("refine", "nms"),
                ("score_threshold", score_threshold.as_str()),
            ];
            write_sweep(&data_set, &folder, &DetectParameters::parse(base)?)
        }
        Command::Plot {
            data_set,
            plot,
            detections,
        } => write_plot(&data_set, &plot, &detections),
    }
}

fn write_sweep(data_set: &Path, folder: &Path, base: &DetectParameters) -> anyhow::Result<()> {
    let settings = settings::load(None, settings::environment())?;
    let data_set = DataSet::open(data_set)?;
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let engine = engine_for(&settings, std::slice::from_ref(base))?;
    let at_once = settings.threads.frame_workers;
    let mut cells = Vec::new();
    for row in detect(&engine, &data_set, &sweep::cells(base), at_once, || {})? {
        let evaluated = row.evaluate(&data_set)?;
        cells.push((row, evaluated));
    }
    let title = match cells.first() {
        Some((row, _)) => format!("{}, {}", base.profile.name(), row.name.model),
        None => base.profile.name().to_owned(),
    };
    let plot = sweep::iou_threshold_plot(title, &cells).svg()?;
    write(&folder.join("cells.csv"), sweep::table(&cells).as_bytes())?;
    write(&folder.join("iou_threshold.svg"), plot.as_bytes())
}

fn write_plot(data_set: &Path, file: &Path, detections: &[PathBuf]) -> anyhow::Result<()> {
    let folder = data_set.file_name().unwrap_or_default().to_string_lossy();
    let data_set = DataSet::open(data_set)?;
    let mut rows = Vec::new();
    for path in detections {
        let row = DetectedRow::load(path, &data_set)?;
        rows.push((row.name.to_string(), row.evaluate(&data_set)?));
    }
    let title = format!("{folder}: {} images", data_set.images.len());
    let plot = precision_recall_plot(title, rows.iter().map(|(name, row)| (name.clone(), row)));
    match file.extension().and_then(|ending| ending.to_str()) {
        Some("svg") => write(file, plot.svg()?.as_bytes()),
        Some("png") => write(file, &plot.png()?),
        _ => bail!("a plot is an .svg or a .png file; give its name one of these extensions"),
    }
}

fn write(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    fs::write(path, content).with_context(|| format!("{} cannot be written", path.display()))
}
