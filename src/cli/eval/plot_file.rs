//! `--plot`: a plot of the rows.

use std::{ffi::OsStr, fs, path::Path, str::FromStr};

use anyhow::Context;
use lookdown_eval::LinePlot;

/// The output file of a plot: SVG or PNG, by its extension.
#[derive(Debug, Clone)]
pub(super) struct PlotFile {
    path: std::path::PathBuf,
    is_png: bool,
}

/// The extension is not supported.
#[derive(Debug, thiserror::Error)]
#[error("a plot is an .svg or a .png file; give its name one of these extensions")]
pub(super) struct NoPlotFile;

impl FromStr for PlotFile {
    type Err = NoPlotFile;

    fn from_str(name: &str) -> Result<Self, NoPlotFile> {
        let ending = Path::new(name).extension().unwrap_or(OsStr::new(""));
        let is_png = ending.eq_ignore_ascii_case("png");
        if !is_png && !ending.eq_ignore_ascii_case("svg") {
            return Err(NoPlotFile);
        }
        Ok(Self {
            path: name.into(),
            is_png,
        })
    }
}

impl PlotFile {
    pub(super) fn write(&self, plot: &LinePlot) -> anyhow::Result<()> {
        let encoded = if self.is_png {
            plot.png()?
        } else {
            plot.svg()?.into_bytes()
        };
        fs::write(&self.path, encoded)
            .with_context(|| format!("{} cannot be written", self.path.display()))
    }
}
