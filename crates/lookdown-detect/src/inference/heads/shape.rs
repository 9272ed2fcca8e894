//! Comparison of output shapes with the requirements of a head.

use std::fmt;

use super::tensor::Output;

/// Properties of a batch that are known when shapes are checked.
#[derive(Debug, Clone, Copy)]
pub(super) struct Batch {
    /// Number of views. `None` while the model is loaded.
    pub(super) views: Option<usize>,
    /// Width of the network's input, pixels.
    pub(super) width: u32,
    /// Height of the network's input, pixels.
    pub(super) height: u32,
}

/// Requirement on one axis of an output. Axes with the same name must be equal.
#[derive(Debug, Clone, Copy)]
pub(super) enum Axis {
    /// One entry per view.
    Views,
    Any,
    Exactly(usize),
    AtLeast(usize, &'static str),
    /// Number of whole cells along a side of the given length in pixels.
    Dividing(u32, &'static str),
    /// A number of anchors, each with at least `at_least` channels.
    PerAnchor {
        anchors: usize,
        at_least: usize,
    },
}

impl Axis {
    fn admits(self, found: usize, batch: &Batch) -> bool {
        match self {
            Self::Views => batch.views.is_none_or(|views| views == found),
            Self::Any => true,
            Self::Exactly(wanted) => found == wanted,
            Self::AtLeast(least, _) => found >= least,
            Self::Dividing(pixels, _) => {
                found > 0 && u32::try_from(found).is_ok_and(|cells| pixels.is_multiple_of(cells))
            }
            Self::PerAnchor { anchors, at_least } => {
                found.is_multiple_of(anchors) && found / anchors.max(1) >= at_least
            }
        }
    }

    fn name(self) -> Option<&'static str> {
        match self {
            Self::AtLeast(_, name) | Self::Dividing(_, name) => Some(name),
            Self::Views | Self::Any | Self::Exactly(_) | Self::PerAnchor { .. } => None,
        }
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Views => f.write_str("views"),
            Self::Any => f.write_str("any"),
            Self::Exactly(wanted) => wanted.fmt(f),
            Self::AtLeast(0 | 1, name) => f.write_str(name),
            Self::AtLeast(least, name) => write!(f, "{name} (at least {least})"),
            Self::Dividing(pixels, name) => write!(f, "{name} (dividing {pixels})"),
            Self::PerAnchor { anchors, at_least } => {
                write!(f, "{anchors} × channels (at least {at_least})")
            }
        }
    }
}

impl Batch {
    /// Checks outputs against the requirements on their axes.
    pub(super) fn require(&self, wanted: &[(&Output<'_>, &[Axis])]) -> Result<(), String> {
        let mut known: Vec<(&str, usize)> = Vec::new();
        for &(output, axes) in wanted {
            let found = &output.dimensions;
            // A graph may leave the number of axes open. Each run checks it.
            if self.views.is_none() && found.is_empty() {
                continue;
            }
            let axes_found = || axes.iter().zip(found.iter().copied());
            let fits = |(axis, dimension): (&Axis, Option<usize>)| {
                let Some(dimension) = dimension else {
                    return true;
                };
                let agrees = |&(name, known)| Some(name) != axis.name() || known == dimension;
                axis.admits(dimension, self) && known.iter().all(agrees)
            };
            if found.len() != axes.len() || !axes_found().all(fits) {
                return Err(self.misfit(output, axes, &known));
            }
            known.extend(axes_found().filter_map(|(axis, found)| axis.name().zip(found)));
        }
        Ok(())
    }

    fn misfit(&self, output: &Output<'_>, axes: &[Axis], known: &[(&str, usize)]) -> String {
        let found = output
            .dimensions
            .iter()
            .map(|dimension| dimension.map_or("?".to_owned(), |d| d.to_string()));
        let wanted = axes.iter().map(|axis| {
            let equal = known.iter().find(|(name, _)| axis.name() == Some(name));
            match (axis, equal, self.views) {
                (Axis::Views, _, Some(views)) => format!("{views} views"),
                (Axis::AtLeast(least, name), Some((_, d)), _) if d >= least => {
                    format!("{d} {name}")
                }
                _ => axis.to_string(),
            }
        });
        format!(
            "its output {:?} is [{}]; [{}] is needed for an input of {}×{} pixels (is [output] in \
             the manifest right for this model?)",
            output.name,
            found.collect::<Vec<_>>().join(", "),
            wanted.collect::<Vec<_>>().join(", "),
            self.width,
            self.height
        )
    }
}

/// Refuses numbers in the manifest that are not positive.
pub(super) fn check_positive<'n>(
    field: &str,
    numbers: impl IntoIterator<Item = &'n f64>,
) -> Result<(), String> {
    let wrong = |number: &&f64| !(number.is_finite() && **number > 0.0);
    match numbers.into_iter().find(wrong) {
        None => Ok(()),
        Some(number) => Err(format!(
            "`{field}` in the manifest's [output] contains {number}; only numbers above 0 are valid"
        )),
    }
}
