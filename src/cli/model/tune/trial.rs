//! Measurement of a model with a tuning, from a copy of its folder.

use std::{fmt, fs, path::Path};

use anyhow::Context;
use lookdown_detect::{
    inference::MANIFEST,
    parameters::{DetectParameters, Profile, Tuning},
};
use lookdown_eval::{DEFAULT_COUNT_THRESHOLD, DataSet, ScoreFit};
use tempfile::TempDir;
use toml_edit::{DocumentMut, value};

use super::manifest_entry::set;
use crate::{
    app::engine_for,
    cli::eval::{DEFAULT_SCORE_THRESHOLD, detect_group},
    settings::Settings,
};

/// The name of the ONNX file in the copy.
const ONNX: &str = "model.onnx";

/// A copy of a model's folder, whose manifest changes with each measurement.
pub(super) struct Trial {
    folder: TempDir,
    manifest: DocumentMut,
    settings: Settings,
}

/// The figures of a tuning.
#[derive(Debug, Clone, Copy)]
pub(super) struct Figures {
    pub(super) tuning: Tuning,
    ap50: f64,
    ap75: f64,
    /// Mean error of the number of persons of an image, at the default threshold.
    pub(super) count_error: f64,
    /// The change of scores that fits the persons.
    pub(super) fit: Option<ScoreFit>,
}

impl Trial {
    /// Copies the ONNX file. The manifest is `manifest` without its sum.
    pub(super) fn new(
        mut settings: Settings,
        onnx: &Path,
        mut manifest: DocumentMut,
    ) -> anyhow::Result<Self> {
        let folder = tempfile::tempdir().context("the temporary folder cannot be written")?;
        fs::copy(onnx, folder.path().join(ONNX))
            .with_context(|| format!("{} cannot be copied", onnx.display()))?;
        manifest.insert("onnx", value(ONNX));
        manifest.remove("upstream");
        settings.model.path = Some(folder.path().to_owned());
        Ok(Self {
            folder,
            manifest,
            settings,
        })
    }

    /// Detects the persons of the data set with a profile and a tuning for it.
    pub(super) fn measure(
        &self,
        data_set: &DataSet,
        profile: Profile,
        tuning: &Tuning,
    ) -> anyhow::Result<Figures> {
        let mut manifest = self.manifest.clone();
        set(&mut manifest, profile, tuning)?;
        let path = self.folder.path().join(MANIFEST);
        fs::write(&path, manifest.to_string())
            .with_context(|| format!("{} cannot be written", path.display()))?;
        let given = [
            ("profile", profile.name()),
            ("refine", "fusion"),
            ("score_threshold", DEFAULT_SCORE_THRESHOLD),
        ];
        let parameters = [DetectParameters::parse(given)?];
        let engine = engine_for(&self.settings, &parameters)?;
        let rows = detect_group(&engine, data_set, &parameters, &self.settings)?;
        let row = rows.first().context("no row was evaluated")?;
        let summary = row.evaluate(data_set)?.summary;
        let counts = row.counts(data_set);
        Ok(Figures {
            tuning: *tuning,
            ap50: summary.ap50.coco_101_point,
            ap75: summary.ap75.coco_101_point,
            count_error: counts.at(DEFAULT_COUNT_THRESHOLD).count_error,
            fit: counts.score_fit(),
        })
    }
}

impl Figures {
    /// Returns the mean of AP50 and AP75: persons found, and tight boxes.
    pub(super) fn precision(&self) -> f64 {
        f64::midpoint(self.ap50, self.ap75)
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Tuning {
            even_odds,
            odds_power,
            crop_fill,
            crop_vote,
        } = self.tuning;
        write!(
            f,
            "even_odds {even_odds:.3}, odds_power {odds_power:.2}, crop_fill {crop_fill:.2}, \
             crop_vote {crop_vote:.2}: AP50 {:.3}, AP75 {:.3}, number wrong by {:.2}",
            self.ap50, self.ap75, self.count_error
        )
    }
}
