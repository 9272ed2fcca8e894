//! Selection of a head's outputs among all outputs of a model.

use lookdown_common::text::Quoted;

use super::tensor::Output;

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
