//! The output of rows: to standard output as they are finished, and finally into the plot.

use std::io::{self, Write};

use anyhow::Context;
use lookdown_eval::{DataSet, DetectedRow, EvaluatedRow, NoPersons, precision_recall_plot};

use super::{
    Arguments,
    table::{self, Row},
};
use crate::cli::output::UNWRITABLE;

/// The rows of one run.
pub(super) struct Output<'a> {
    arguments: &'a Arguments,
    /// Kept only for the plot.
    plotted: Vec<(String, EvaluatedRow)>,
    head_is_due: bool,
}

impl<'a> Output<'a> {
    pub(super) fn new(arguments: &'a Arguments) -> Self {
        Self {
            arguments,
            plotted: Vec::new(),
            head_is_due: !arguments.json,
        }
    }

    pub(super) fn print(
        &mut self,
        detected: &DetectedRow,
        data_set: &DataSet,
    ) -> anyhow::Result<()> {
        // A data set of empty rooms has counts, but neither precision nor recall.
        let evaluated = detected.evaluate(data_set).ok();
        let mut row = Row::new(detected, evaluated.as_ref(), &detected.counts(data_set));
        for by in &self.arguments.by {
            row.add_strata(*by, &detected.strata(data_set, *by).context("--by")?);
        }
        let line = if self.arguments.json {
            serde_json::to_string(&row)?
        } else {
            row.to_string()
        };
        let mut out = io::stdout().lock();
        let written = if std::mem::take(&mut self.head_is_due) {
            writeln!(out, "{}\n{line}", table::HEAD)
        } else {
            writeln!(out, "{line}")
        };
        written.context(UNWRITABLE)?;
        if self.arguments.plot.is_some() {
            self.plotted
                .push((detected.name.to_string(), evaluated.ok_or(NoPersons)?));
        }
        Ok(())
    }

    pub(super) fn plot(&self) -> anyhow::Result<()> {
        let (Some(file), Some((_, first))) = (&self.arguments.plot, self.plotted.first()) else {
            return Ok(());
        };
        let summary = &first.summary;
        let (images, persons) = (summary.images, summary.persons);
        let rows = self.plotted.iter().map(|(name, row)| (name.clone(), row));
        let data_set = self
            .arguments
            .truth
            .data_set
            .file_name()
            .unwrap_or_default();
        let data_set = data_set.to_string_lossy();
        let title = format!("{data_set}: {images} images, {persons} persons");
        file.write(&precision_recall_plot(title, rows))
            .context("--plot")
    }
}
