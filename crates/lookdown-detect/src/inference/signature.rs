//! Input signature of a model, from its declared inputs and its manifest.

use std::{
    num::{NonZeroU32, NonZeroUsize},
    ops::RangeInclusive,
};

use super::{
    description::{FLOAT, Metadata, OnnxTensor, float_shapes},
    manifest::{Layout, ManifestInput, ModelManifest},
};
use lookdown_imaging::NetworkInput;

/// Network input sides accepted, pixels.
const SIDE: RangeInclusive<u32> = 32..=4096;
/// Most views per run that a model may require.
const MAX_VIEWS: u32 = 256;

/// Input signature of a model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Signature {
    pub(super) input_name: String,
    pub(super) layout: Layout,
    /// Views per run. `None` for any number.
    pub(super) views_per_run: Option<NonZeroUsize>,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl ModelManifest {
    /// Checks the inputs and outputs of a model against its manifest. Returns its signature and the
    /// input format.
    pub(super) fn fit(
        &self,
        inputs: &[OnnxTensor],
        outputs: &[OnnxTensor],
        metadata: &Metadata,
    ) -> Result<(Signature, NetworkInput), String> {
        let signature = Signature::new(inputs, &self.input, metadata)?;
        let (width, height) = (signature.width, signature.height);
        let shapes: Vec<_> = float_shapes(outputs).collect();
        self.output.check(&shapes, (width, height))?;
        let (scale, offset) = self.input.normalization()?;
        let input = NetworkInput {
            width,
            height,
            channel_order: self.input.channel_order,
            scale,
            offset,
        };
        Ok((signature, input))
    }
}

impl Signature {
    /// Reads the declared inputs. Open dimensions come from the manifest, then from the metadata.
    pub(super) fn new(
        inputs: &[OnnxTensor],
        manifest: &ManifestInput,
        metadata: &Metadata,
    ) -> Result<Self, String> {
        let input = image_input(inputs, manifest)?;
        let [views, first, second, third] = dimensions(input)?;
        let layout = match (manifest.layout, first, third) {
            (Some(layout), ..) => layout,
            (None, first, Some(3)) if first != Some(3) => Layout::Nhwc,
            _ => Layout::Nchw,
        };
        let (planes, height, width) = match layout {
            Layout::Nchw => (first, second, third),
            Layout::Nhwc => (third, first, second),
        };
        if planes.is_some_and(|planes| planes != 3) {
            return Err(misfit(input));
        }
        let [hinted_height, hinted_width] = metadata.size.map_or([None; 2], |size| size.map(Some));
        let stride = manifest.stride.map(NonZeroU32::get).or(metadata.stride);
        let side = |name, declared, chosen: Option<NonZeroU32>, hinted| {
            settle(name, declared, chosen.map(NonZeroU32::get), hinted, stride)
        };
        Ok(Self {
            width: side("width", width, manifest.width, hinted_width)?,
            height: side("height", height, manifest.height, hinted_height)?,
            views_per_run: views_per_run(views, manifest.batch)?,
            layout,
            input_name: input.name.clone(),
        })
    }
}

fn image_input<'i>(
    inputs: &'i [OnnxTensor],
    manifest: &ManifestInput,
) -> Result<&'i OnnxTensor, String> {
    let names = || {
        let names: Vec<_> = inputs
            .iter()
            .map(|input| format!("{:?}", input.name))
            .collect();
        names.join(", ")
    };
    match (&manifest.name, inputs) {
        (None, [only]) => Ok(only),
        (Some(name), [only]) if *name == only.name => Ok(only),
        (Some(name), [_]) => Err(format!(
            "it has no input {name:?}, only {}; correct `name` in the manifest's [input]",
            names()
        )),
        _ => Err(format!(
            "it has the inputs {}; a model with an image as its only input is needed",
            names()
        )),
    }
}

/// The four dimensions. `None` for those left open.
fn dimensions(input: &OnnxTensor) -> Result<[Option<u32>; 4], String> {
    let [a, b, c, d] = input.shape[..] else {
        return Err(misfit(input));
    };
    if input.element != FLOAT || [a, b, c, d].contains(&0) {
        return Err(misfit(input));
    }
    // Negative dimensions are open. A dimension too large for a u32 exceeds every limit.
    let dimension = |side: i64| (side > 0).then(|| u32::try_from(side).unwrap_or(u32::MAX));
    Ok([a, b, c, d].map(dimension))
}

fn misfit(input: &OnnxTensor) -> String {
    format!(
        "its input {:?} is {} {:?}; 32-bit floats [views, 3, height, width] or [views, height, \
         width, 3] are needed",
        input.name, input.element, input.shape
    )
}

fn settle(
    name: &str,
    declared: Option<u32>,
    chosen: Option<u32>,
    hinted: Option<u32>,
    stride: Option<u32>,
) -> Result<u32, String> {
    let side = match (declared, chosen.or(hinted)) {
        (Some(declared), _) if chosen.is_some_and(|chosen| chosen != declared) => {
            return Err(format!(
                "its input's {name} is fixed at {declared}, but the manifest's [input] says {}",
                chosen.unwrap_or_default()
            ));
        }
        (Some(declared), _) => declared,
        (None, Some(side)) => match stride {
            Some(stride) if stride > 0 && !side.is_multiple_of(stride) => {
                return Err(format!(
                    "its input's {name} is {side}, not a multiple of {stride}"
                ));
            }
            _ => side,
        },
        (None, None) => {
            return Err(format!(
                "it leaves its input's {name} open; set it with `{name}` in the manifest's \
                 [input]"
            ));
        }
    };
    if !SIDE.contains(&side) {
        return Err(format!(
            "its input's {name} is {side}; {} to {} pixels are accepted",
            SIDE.start(),
            SIDE.end()
        ));
    }
    Ok(side)
}

fn views_per_run(
    declared: Option<u32>,
    chosen: Option<NonZeroU32>,
) -> Result<Option<NonZeroUsize>, String> {
    let chosen = chosen.map(NonZeroU32::get);
    let views = match (declared, chosen) {
        (Some(declared), Some(chosen)) if declared != chosen => {
            return Err(format!(
                "it takes {declared} views at once, but the manifest's [input] says batch = {chosen}"
            ));
        }
        (declared, chosen) => declared.or(chosen),
    };
    match views {
        Some(views) if views > MAX_VIEWS => Err(format!(
            "it takes {views} views at once; at most {MAX_VIEWS} are accepted"
        )),
        views => Ok(views.and_then(|views| NonZeroUsize::new(views as usize))),
    }
}
