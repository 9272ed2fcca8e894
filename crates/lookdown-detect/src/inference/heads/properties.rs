//! Properties that hold for any outputs.

mod cases;

use proptest::prelude::*;

use self::cases::{CASES, Case, N};
use super::{Head, HeadOutput, InferenceError, OutputShape, TensorView};
use lookdown_imaging::NetworkInput;

const INPUT: (u32, u32) = (8, 4);

fn value() -> impl Strategy<Value = f32> {
    prop_oneof![
        30 => 0.0_f32..=1.0,
        3 => -10.0_f32..10.0,
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-45]),
    ]
}

/// Outputs that fit their head, or almost: one axis may differ or be superfluous.
#[derive(Debug, Clone)]
struct Outputs {
    manifest: &'static str,
    views: usize,
    shapes: [Vec<usize>; 2],
    fit: bool,
}

impl Outputs {
    fn new((manifest, a, b): Case, views: usize, spoil: Option<(bool, usize, usize)>) -> Self {
        let mut shapes = [a, b].map(|shape| {
            let in_batch = |&dimension| if dimension == N { views } else { dimension };
            shape.iter().map(in_batch).collect::<Vec<_>>()
        });
        if let Some((second, axis, dimension)) = spoil {
            let shape = &mut shapes[usize::from(second)];
            match shape.get_mut(axis) {
                Some(spoilt) => *spoilt = dimension,
                None => shape.push(dimension),
            }
        }
        Self {
            manifest,
            views,
            shapes,
            fit: spoil.is_none(),
        }
    }

    fn lens(&self) -> [usize; 2] {
        [0, 1].map(|output: usize| self.shapes[output].iter().product())
    }

    fn head(&self) -> Head {
        toml::from_str(self.manifest).unwrap()
    }

    fn decode(&self, values: [&[f32]; 2], floor: f64) -> Result<HeadOutput, InferenceError> {
        let outputs = [("a", 0), ("b", 1)].map(|(name, output)| TensorView {
            name,
            shape: &self.shapes[output],
            values: values[output],
        });
        let input = NetworkInput::plain(INPUT.0, INPUT.1);
        self.head().decode(&outputs, self.views, &input, floor)
    }
}

fn outputs() -> impl Strategy<Value = Outputs> {
    let spoil = prop::option::of((any::<bool>(), 0..5_usize, 0..10_usize));
    (prop::sample::select(CASES.to_vec()), 0..3_usize, spoil)
        .prop_map(|(case, views, spoil)| Outputs::new(case, views, spoil))
}

fn outputs_and_values() -> impl Strategy<Value = (Outputs, [Vec<f32>; 2])> {
    outputs().prop_flat_map(|outputs| {
        let values = outputs
            .lens()
            .map(|len| prop::collection::vec(value(), len));
        (Just(outputs), values)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn any_values_are_decoded_within_bounds_or_refused(
        (outputs, [a, b]) in outputs_and_values(),
        floor in prop_oneof![Just(0.0), Just(1.0), 0.0..1.0],
    ) {
        let Ok(found) = outputs.decode([&a, &b], floor) else {
            return Ok(());
        };
        prop_assert_eq!(found.per_view.len(), outputs.views);
        let persons = found.per_view.iter().map(Vec::len).sum::<usize>();
        prop_assert!(persons + found.non_finite <= a.len() + b.len());
        for person in found.per_view.iter().flatten() {
            prop_assert!(person.score >= floor && person.score <= 1.0);
            let [x_min, y_min, x_max, y_max] = person.bbox.corners();
            prop_assert!(0.0 <= x_min && x_min < x_max && x_max <= 8.0);
            prop_assert!(0.0 <= y_min && y_min < y_max && y_max <= 4.0);
        }
    }

    #[test]
    fn a_head_decodes_what_it_accepts_when_loaded(outputs in outputs(), open in any::<u8>()) {
        let declared = |open: u8| [0, 1].map(|output: usize| -> Vec<i64> {
            let is_open = |axis: usize| open >> (axis + 4 * output) & 1 == 1;
            let dimensions = outputs.shapes[output].iter().enumerate();
            dimensions.map(|(axis, &d)| if is_open(axis) { -1 } else { i64::try_from(d).unwrap() }).collect()
        });
        let accepts = |[a, b]: [Vec<i64>; 2]| {
            let shapes = [OutputShape { name: "a", shape: &a }, OutputShape { name: "b", shape: &b }];
            outputs.head().check(&shapes, INPUT).is_ok()
        };
        let [a, b] = outputs.lens().map(|len| vec![0.5; len]);
        let decoded = outputs.decode([&a, &b], 0.3);
        prop_assert!(decoded.is_ok() || !outputs.fit, "{:?}", decoded);
        if decoded.is_ok() {
            prop_assert!(accepts(declared(0)));
            // Where outputs are distinguished by shape, their last axes must be known.
            let by_shape = !outputs.manifest.contains("'a'");
            prop_assert!(by_shape || accepts(declared(open & 0b0111_0111)));
        }
    }
}
