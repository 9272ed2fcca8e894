//! Conversion of batches to a model's fixed number of views and its order of axes.

use std::num::NonZeroUsize;

use super::{HeadOutput, InferenceError, Layout, signature::Signature};
use lookdown_imaging::{NetworkInput, ViewBatch};

/// Converts batches to inputs.
pub(super) struct Staging {
    input_name: String,
    layout: Layout,
    views_per_run: Option<NonZeroUsize>,
    /// Reused from run to run. Empty for models that take batches unchanged.
    values: Vec<f32>,
}

/// The input of one run.
pub(super) struct Staged<'a> {
    pub(super) name: &'a str,
    pub(super) shape: [usize; 4],
    pub(super) values: &'a [f32],
}

impl Staging {
    /// Staging for a model; `views_per_run` is for one that takes any number of views.
    pub(super) fn new(signature: &Signature, views_per_run: Option<NonZeroUsize>) -> Self {
        Self {
            input_name: signature.input_name.clone(),
            layout: signature.layout,
            views_per_run: signature.views_per_run.or(views_per_run),
            values: Vec::new(),
        }
    }

    /// The batch's values in pieces of one run each.
    fn pieces<'b>(
        &self,
        batch: &'b ViewBatch,
        input: &NetworkInput,
    ) -> std::slice::Chunks<'b, f32> {
        let views = self.views_per_run.map_or(batch.views(), NonZeroUsize::get);
        batch.values().chunks(views.max(1) * input.view_len())
    }

    /// Runs a network on all views of a batch, piece by piece, and collects what it finds in each
    /// view: at most `max_per_view` candidates, best first.
    pub(super) fn run_pieces(
        &mut self,
        batch: &ViewBatch,
        input: &NetworkInput,
        max_per_view: usize,
        mut run: impl FnMut(&Staged<'_>) -> Result<HeadOutput, InferenceError>,
    ) -> Result<HeadOutput, InferenceError> {
        let mut found = HeadOutput::default();
        for piece in self.pieces(batch, input) {
            let output = run(&self.stage(piece, input))?;
            let views = piece.len() / input.view_len();
            found.non_finite += output.non_finite;
            found
                .per_view
                .extend(output.per_view.into_iter().take(views));
        }
        found.keep_best(max_per_view);
        Ok(found)
    }

    /// Converts a piece to an input. Missing views of a fixed number are filled with black ones.
    fn stage<'a>(&'a mut self, piece: &'a [f32], input: &NetworkInput) -> Staged<'a> {
        let given = piece.len() / input.view_len();
        let views = self.views_per_run.map_or(given, NonZeroUsize::get);
        let (width, height) = (input.width as usize, input.height as usize);
        let shape = match self.layout {
            Layout::Nchw => [views, 3, height, width],
            Layout::Nhwc => [views, height, width, 3],
        };
        let as_it_is = self.layout == Layout::Nchw && given == views;
        if !as_it_is {
            self.values.resize(views * input.view_len(), 0.0);
            let (used, spare) = self.values.split_at_mut(piece.len());
            match self.layout {
                Layout::Nchw => used.copy_from_slice(piece),
                Layout::Nhwc => interleave(piece, used, input),
            }
            spare.fill(0.0);
        }
        Staged {
            name: &self.input_name,
            shape,
            values: if as_it_is { piece } else { &self.values },
        }
    }
}

/// Converts planes to interleaved pixels.
fn interleave(piece: &[f32], out: &mut [f32], input: &NetworkInput) {
    let views = piece.chunks_exact(input.view_len());
    for (view, out) in views.zip(out.chunks_exact_mut(input.view_len())) {
        for (plane, values) in view.chunks_exact(input.plane_len()).enumerate() {
            for (pixel, &value) in out.chunks_exact_mut(3).zip(values) {
                pixel[plane] = value;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn staging(layout: Layout, views_per_run: usize) -> Staging {
        Staging::new(&signature(layout, views_per_run), None)
    }

    fn signature(layout: Layout, views_per_run: usize) -> Signature {
        Signature {
            input_name: "images".to_owned(),
            layout,
            views_per_run: NonZeroUsize::new(views_per_run),
            width: 2,
            height: 1,
        }
    }

    /// Values 1, 2, 3, … in views of 2×1 pixels.
    fn batch(views: u8) -> (ViewBatch, NetworkInput) {
        let input = NetworkInput::plain(2, 1);
        let mut batch = ViewBatch::default();
        let mut next = 0.0;
        for value in batch.prepare(views.into(), &input).flatten() {
            next += 1.0;
            *value = next;
        }
        (batch, input)
    }

    #[test]
    fn an_open_batch_is_passed_on_unchanged() {
        let (batch, input) = batch(3);
        let mut staging = staging(Layout::Nchw, 0);
        let pieces: Vec<_> = staging.pieces(&batch, &input).collect();
        assert_eq!(pieces, [batch.values()]);
        let staged = staging.stage(pieces[0], &input);
        assert_eq!(
            (staged.shape, staged.values),
            ([3, 3, 1, 2], batch.values())
        );
    }

    #[test]
    fn a_fixed_batch_is_split_and_the_last_piece_is_padded() {
        let (batch, input) = batch(3);
        let mut staging = staging(Layout::Nchw, 2);
        let pieces: Vec<_> = staging.pieces(&batch, &input).collect();
        assert_eq!(pieces.len(), 2);
        assert_eq!(
            staging.stage(pieces[0], &input).values,
            &batch.values()[..12]
        );
        let last = staging.stage(pieces[1], &input);
        assert_eq!(last.shape, [2, 3, 1, 2]);
        assert_eq!(last.values[..6], batch.values()[12..]);
        assert_eq!(last.values[6..], [0.0; 6]);
    }

    #[test]
    fn an_open_batch_is_padded_to_the_number_of_the_options() {
        let (batch, input) = batch(3);
        let mut staging = Staging::new(&signature(Layout::Nchw, 0), NonZeroUsize::new(4));
        let pieces: Vec<_> = staging.pieces(&batch, &input).collect();
        assert_eq!(pieces, [batch.values()]);
        let staged = staging.stage(pieces[0], &input);
        assert_eq!(staged.shape, [4, 3, 1, 2]);
        assert_eq!(staged.values[..18], *batch.values());
        assert_eq!(staged.values[18..], [0.0; 6]);
    }

    #[test]
    fn planes_become_pixels_for_models_with_planes_last() {
        let (batch, input) = batch(1);
        let mut staging = staging(Layout::Nhwc, 0);
        let staged = staging.stage(batch.values(), &input);
        assert_eq!(staged.shape, [1, 1, 2, 3]);
        assert_eq!(staged.values, [1.0, 3.0, 5.0, 2.0, 4.0, 6.0]);
    }
}
