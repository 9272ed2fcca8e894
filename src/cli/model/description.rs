//! The description of a model as text.

use std::fmt;

use lookdown_detect::inference::{ModelDescription, OnnxTensor};
use lookdown_imaging::ChannelOrder;

/// One property per line.
pub(super) struct Lines<'a>(pub(super) &'a ModelDescription);

impl fmt::Display for Lines<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.0;
        let manifest = &model.manifest;
        let unknown = || "not stated".to_owned();
        let checked = match &manifest.sha256 {
            Some(_) => "as in the manifest",
            None => "not in the manifest",
        };
        let license = model.license.clone().unwrap_or_else(unknown);
        let source = manifest.source.clone().unwrap_or_else(unknown);
        writeln!(f, "name         {}", manifest.name)?;
        writeln!(
            f,
            "file         {}, {} bytes",
            manifest.onnx.display(),
            model.bytes
        )?;
        writeln!(f, "sha256       {} ({checked})", model.sha256)?;
        writeln!(f, "revision     {}", model.revision)?;
        writeln!(f, "license      {license}")?;
        writeln!(f, "source       {source}")?;
        for (what, tensors) in [("input", &model.inputs), ("output", &model.outputs)] {
            for OnnxTensor {
                name,
                element,
                shape,
            } in tensors
            {
                let shape: Vec<_> = shape.iter().copied().map(dimension).collect();
                writeln!(f, "{what:<12} {name}: {element} [{}]", shape.join(", "))?;
            }
        }
        let input = &model.input;
        let order = match input.channel_order {
            ChannelOrder::Rgb => "rgb",
            ChannelOrder::Bgr => "bgr",
        };
        let views = match model.views_per_run {
            Some(views) => format!("{views} at once"),
            None => "any number at once".to_owned(),
        };
        writeln!(
            f,
            "pixels       {}×{}, {}, {order}, 0..255 × {:?} + {:?}",
            input.width, input.height, model.layout, input.scale, input.offset
        )?;
        writeln!(f, "views        {views}")?;
        let head = &manifest.output;
        writeln!(f, "head         {}: {}", head.name(), head.description())
    }
}

fn dimension(side: i64) -> String {
    match side {
        ..0 => "any".to_owned(),
        side => side.to_string(),
    }
}
