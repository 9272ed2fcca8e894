//! The output of rows: to standard output as they are finished.

use std::io::{self, Write};

use anyhow::Context;
use lookdown_eval::{DataSet, DetectedRow};

use super::{
    Arguments,
    table::{self, Row},
};
use crate::cli::output::UNWRITABLE;

/// The rows of one run.
pub(super) struct Output<'a> {
    arguments: &'a Arguments,
    head_is_due: bool,
}

impl<'a> Output<'a> {
    pub(super) fn new(arguments: &'a Arguments) -> Self {
        Self {
            arguments,
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
        written.context(UNWRITABLE)
    }
}
