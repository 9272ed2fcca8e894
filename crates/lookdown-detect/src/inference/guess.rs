//! Guesses of the tables of a manifest, from the inputs and outputs of a network.

use super::{
    description::{OnnxTensor, float_shapes},
    heads::{Head, OutputShape},
};

/// Side of the input if the network leaves it open, pixels.
const OPEN_SIDE: u32 = 640;

/// A head with the family of networks that has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GuessedHead {
    /// The family of networks.
    pub family: &'static str,
    /// The number of values of a cell or query with the 80 classes of COCO.
    length: i64,
    /// The table `[output]` of a manifest, without its title.
    pub table: &'static str,
}

/// The inputs of networks: a description, and the table `[input]` of a manifest without its title.
pub const INPUTS: [(&str, &str); 5] = [
    ("rgb, 0 to 255", ""),
    ("bgr, 0 to 255", "channel_order = \"bgr\"\n"),
    (
        "rgb, 0 to 1",
        "scale = [0.00392156863, 0.00392156863, 0.00392156863]\n",
    ),
    (
        "rgb, mean and deviation of ImageNet",
        "mean = [123.675, 116.28, 103.53]\nstd = [58.395, 57.12, 57.375]\n",
    ),
    (
        "bgr, mean and deviation of ImageNet",
        "channel_order = \"bgr\"\nmean = [103.53, 116.28, 123.675]\nstd = [57.375, 57.12, 58.395]\n",
    ),
];

/// Heads in the order in which they are tried.
const HEADS: [GuessedHead; 9] = [
    row("decoded by the graph", 4, "head = \"boxes_scores\"\n"),
    row(
        "RF-DETR",
        91,
        "head = \"detr\"\nperson_class = 1\nboxes = \"dets\"\nscores = \"labels\"\n",
    ),
    row("RT-DETR, D-FINE", 80, "head = \"detr\"\nperson_class = 0\n"),
    row(
        "DETR",
        92,
        "head = \"detr\"\nperson_class = 1\nscore_activation = \"softmax\"\n",
    ),
    row("YOLOX", 85, "head = \"yolox\"\nperson_class = 0\n"),
    row(
        "YOLOv8, YOLO11",
        84,
        "head = \"yolo_v8\"\nperson_class = 0\n",
    ),
    row(
        "NanoDet-Plus",
        112,
        "head = \"nanodet\"\nperson_class = 0\n",
    ),
    row(
        "NanoDet-g",
        124,
        "head = \"nanodet\"\nperson_class = 0\nstrides = [8, 16, 32]\nreg_max = 10\nprior = \"center\"\n",
    ),
    row(
        "end to end, as YOLO26",
        6,
        "head = \"end_to_end\"\nperson_class = 0\n",
    ),
];

const fn row(family: &'static str, length: i64, table: &'static str) -> GuessedHead {
    GuessedHead {
        family,
        length,
        table,
    }
}

/// Returns the head that can read these outputs, first one with the 80 classes of COCO.
pub fn guess_head(outputs: &[OnnxTensor], size: (u32, u32)) -> Option<GuessedHead> {
    let shapes: Vec<_> = float_shapes(outputs).collect();
    let has_length = |row: &&GuessedHead| {
        let mut axes = shapes.iter().flat_map(|output| output.shape.iter().skip(1));
        axes.any(|axis| *axis == row.length)
    };
    let fits = |row: &&GuessedHead| can_read(row.table, &shapes, size);
    let mut fitting = HEADS.iter().filter(fits);
    let exact = fitting.clone().find(has_length);
    exact.or_else(|| fitting.next()).copied()
}

fn can_read(table: &str, shapes: &[OutputShape<'_>], size: (u32, u32)) -> bool {
    toml::from_str::<Head>(table).is_ok_and(|head| head.check(shapes, size).is_ok())
}

/// Returns width and height of the image that a network takes, and true if it leaves them open.
pub fn guess_size(inputs: &[OnnxTensor]) -> ((u32, u32), bool) {
    let sides = inputs.iter().find_map(|input| match input.shape[..] {
        [_, 3, height, width] | [_, height, width, 3] => Some([width, height]),
        _ => None,
    });
    let known = sides.map(|sides| sides.map(|side| u32::try_from(side).ok()));
    match known {
        Some([Some(width), Some(height)]) => ((width, height), false),
        _ => ((OPEN_SIDE, OPEN_SIDE), true),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names and shapes of the outputs of a network.
    type Shapes<'a> = &'a [(&'a str, &'a [i64])];

    fn outputs(shapes: Shapes<'_>) -> Vec<OnnxTensor> {
        let tensors = shapes.iter().map(|(name, shape)| OnnxTensor {
            name: (*name).to_owned(),
            element: "f32".to_owned(),
            shape: shape.to_vec(),
        });
        tensors.collect()
    }

    fn family(shapes: Shapes<'_>) -> Option<&'static str> {
        guess_head(&outputs(shapes), (416, 416)).map(|row| row.family)
    }

    #[test]
    fn families_are_guessed_from_their_outputs() {
        let queries: &[i64] = &[1, 300, 4];
        let known: [(Shapes<'_>, &str); 8] = [
            (&[("output", &[1, 3549, 85])], "YOLOX"),
            (&[("output0", &[1, 84, 3549])], "YOLOv8, YOLO11"),
            (&[("output", &[-1, 3598, 112])], "NanoDet-Plus"),
            (&[("output", &[1, 3549, 124])], "NanoDet-g"),
            (
                &[("logits", &[1, 300, 80]), ("pred_boxes", queries)],
                "RT-DETR, D-FINE",
            ),
            (&[("dets", queries), ("labels", &[1, 300, 91])], "RF-DETR"),
            (&[("output0", &[1, 300, 6])], "end to end, as YOLO26"),
            (
                &[("boxes", queries), ("scores", &[1, 300])],
                "decoded by the graph",
            ),
        ];
        for (outputs, name) in known {
            assert_eq!(family(outputs), Some(name));
        }
        assert_eq!(family(&[("embedding", &[1, 512])]), None);
    }

    #[test]
    fn open_sides_are_given_a_size() {
        let open = outputs(&[("images", &[-1, 3, -1, -1])]);
        assert_eq!(guess_size(&open), ((640, 640), true));
        let fixed = outputs(&[("images", &[1, 320, 416, 3])]);
        assert_eq!(guess_size(&fixed), ((416, 320), false));
    }
}
