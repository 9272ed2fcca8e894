//! Outputs of a network: their declared shapes and values, the selection of a head's outputs, and
//! the comparison of their shapes with the requirements of the head.

use std::fmt;

use lookdown_common::text::Quoted;

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

/// An output declared by the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutputShape<'a> {
    /// The output's name in the model.
    pub name: &'a str,
    /// Its dimensions. -1 (or any negative number) stands for one that is known only at run time.
    pub shape: &'a [i64],
}

/// An output of one run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TensorView<'a> {
    /// The output's name in the model.
    pub name: &'a str,
    /// Its dimensions. Their product must be the number of values, otherwise
    /// [`super::Head::decode`] refuses the tensor.
    pub shape: &'a [usize],
    /// Its values, row-major.
    pub values: &'a [f32],
}

/// Properties of an output for shape checks before and after a run.
pub(super) struct Output<'a> {
    /// Its place among the outputs of the model.
    pub(super) index: usize,
    pub(super) name: &'a str,
    /// The dimensions. `None` for one that is not known yet.
    pub(super) dimensions: Vec<Option<usize>>,
}

impl<'a> Output<'a> {
    /// The outputs with these names and dimensions, in the order of the model.
    pub(super) fn all<D: TryInto<usize> + Copy + 'a>(
        outputs: impl Iterator<Item = (&'a str, &'a [D])>,
    ) -> Vec<Self> {
        let outputs = outputs.enumerate().map(|(index, (name, shape))| Self {
            index,
            name,
            dimensions: shape.iter().map(|&side| side.try_into().ok()).collect(),
        });
        outputs.collect()
    }
}

impl<'a> TensorView<'a> {
    /// Refuses a shape whose product differs from the number of values.
    pub(super) fn check_len(&self) -> Result<(), String> {
        let product = self.shape.iter().try_fold(1_usize, |product, &dimension| {
            product.checked_mul(dimension)
        });
        if product == Some(self.values.len()) {
            return Ok(());
        }
        Err(format!(
            "its output {:?} has {} values for the shape {:?}",
            self.name,
            self.values.len(),
            self.shape
        ))
    }

    /// The values of each entry of the first axis.
    pub(super) fn views(&self) -> impl Iterator<Item = &'a [f32]> + use<'a> {
        let views = self.shape.first().copied().unwrap_or(0);
        let values = self.values;
        let len = values.len().checked_div(views).unwrap_or(0);
        (0..views).map(move |view| &values[view * len..][..len])
    }
}

/// Most names of outputs in a message.
const MAX_NAMES: usize = 16;

/// Returns the output with that name.
pub(super) fn named<'o>(outputs: &'o [Output<'o>], name: &str) -> Result<&'o Output<'o>, String> {
    let found = outputs.iter().find(|output| output.name == name);
    found.ok_or_else(|| {
        format!(
            "it has no output {name:?}, only {}; name the right one in the manifest's [output]",
            names(outputs)
        )
    })
}

/// Returns the output with that name. Without a name, the only output.
pub(super) fn named_or_only<'o>(
    outputs: &'o [Output<'o>],
    name: Option<&str>,
) -> Result<&'o Output<'o>, String> {
    match (name, outputs) {
        (Some(name), _) => named(outputs, name),
        (None, [only]) => Ok(only),
        (None, _) => Err(format!(
            "it has the outputs {}; select one with `name` in the manifest's [output]",
            names(outputs)
        )),
    }
}

/// Returns the outputs with boxes and with the scores of all classes, by name or else by shape.
/// Both have three axes, and the last axis of the boxes is 4.
pub(super) fn boxes_and_scores<'o>(
    outputs: &'o [Output<'o>],
    [boxes, scores]: [Option<&str>; 2],
) -> Result<[&'o Output<'o>; 2], String> {
    let find = |name: Option<&str>, last_axis_is_four: bool| {
        if let Some(name) = name {
            return named(outputs, name).map(Some);
        }
        // An axis of unknown length could be either.
        let mut fitting = outputs.iter().filter(|output| {
            let dimensions = &output.dimensions;
            let last = dimensions.last().copied().flatten();
            dimensions.len() == 3
                && last.is_none_or(|last| last_axis_is_four == (last == 4))
                && ![boxes, scores].contains(&Some(output.name))
        });
        Ok(fitting.next().filter(|_| fitting.next().is_none()))
    };
    if let (Some(boxes), Some(scores)) = (find(boxes, true)?, find(scores, false)?) {
        return Ok([boxes, scores]);
    }
    Err(format!(
        "its outputs {} with boxes and scores cannot be distinguished by shape; name them with \
         `boxes` and `scores` in the manifest's [output]",
        names(outputs)
    ))
}

/// Lists the first names of the outputs.
pub(super) fn names(outputs: &[Output<'_>]) -> String {
    let names = outputs.iter().take(MAX_NAMES);
    let mut names: Vec<_> = names.map(|o| Quoted(o.name).to_string()).collect();
    if outputs.len() > MAX_NAMES {
        names.push("…".to_owned());
    }
    names.join(", ")
}
