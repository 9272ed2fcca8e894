//! Outputs of a network: their declared shapes and their values.

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
