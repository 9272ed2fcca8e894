//! Manifests of well-known models with the output shapes of these models.

use super::head;
use crate::inference::heads::OutputShape;

/// Asserts that the manifest's head accepts the outputs.
fn fits(manifest: &str, side: u32, outputs: &[(&str, &[i64])]) {
    let outputs: Vec<OutputShape<'_>> = outputs
        .iter()
        .map(|&(name, shape)| OutputShape { name, shape })
        .collect();
    assert_eq!(head(manifest).check(&outputs, (side, side)), Ok(()));
}

#[test]
fn the_paper_s_yolo_v2_fits() {
    let manifest = "head = 'yolo_v2'\nperson_class = 14\nanchors = [[1.3221, 1.73145], \
                    [3.19275, 4.00944], [5.05587, 8.09892], [9.47112, 4.84053], \
                    [11.2364, 10.0071]]";
    fits(manifest, 416, &[("grid", &[-1, 125, 13, 13])]);
}

#[test]
fn yolox_s_fits() {
    fits(
        "head = 'yolox'\nperson_class = 0",
        640,
        &[("output", &[1, 8400, 85])],
    );
}

#[test]
fn nanodets_fit() {
    let plus = "head = 'nanodet'\nperson_class = 0";
    fits(plus, 320, &[("output", &[1, 2125, 112])]);
    fits(plus, 416, &[("output", &[1, 3598, 112])]);
    let g = "head = 'nanodet'\nperson_class = 0\nstrides = [8, 16, 32]\nreg_max = 10\nprior = \
             'center'";
    fits(g, 416, &[("output", &[-1, 3549, 124])]);
}

#[test]
fn yolo_v8_and_11_fit() {
    let manifest = "head = 'yolo_v8'\nperson_class = 0";
    fits(manifest, 640, &[("output0", &[1, 84, 8400])]);
    let segmentation = "head = 'yolo_v8'\nperson_class = 0\nname = 'output0'";
    let outputs: [(&str, &[i64]); 2] = [
        ("output0", &[1, 116, 8400]),
        ("output1", &[1, 32, 160, 160]),
    ];
    fits(segmentation, 640, &outputs);
}

#[test]
fn detr_descendants_fit() {
    let real_time: [(&str, &[i64]); 2] =
        [("logits", &[-1, 300, 80]), ("pred_boxes", &[-1, 300, 4])];
    fits("head = 'detr'\nperson_class = 0", 640, &real_time);
    let coco_numbered: [(&str, &[i64]); 2] = [("dets", &[1, 300, 4]), ("labels", &[1, 300, 91])];
    fits("head = 'detr'\nperson_class = 1", 560, &coco_numbered);
    let detr: [(&str, &[i64]); 2] = [("logits", &[-1, 100, 92]), ("pred_boxes", &[-1, 100, 4])];
    let softmax = "head = 'detr'\nperson_class = 1\nscore_activation = 'softmax'";
    fits(softmax, 800, &detr);
}

#[test]
fn graphs_that_include_suppression_fit() {
    fits(
        "head = 'end_to_end'\nperson_class = 0",
        640,
        &[("output0", &[1, 300, 6])],
    );
    let seven = "head = 'end_to_end'\nperson_class = 0\ncolumns = ['view', 'x_min', 'y_min', \
                 'x_max', 'y_max', 'class', 'score']";
    fits(seven, 640, &[("output", &[-1, 7])]);
    let caffe = "head = 'end_to_end'\nperson_class = 1\nunit = 'share'\ncolumns = ['view', \
                 'class', 'score', 'x_min', 'y_min', 'x_max', 'y_max']";
    fits(caffe, 320, &[("detection_out", &[1, 1, 200, 7])]);
}
