"""Values of the id masks beside persons (1 to 200): things that detectors take for persons."""

CHAIR_WITH_JACKET, MANNEQUIN, IMAGE_OF_PERSON, COATS, PRAM = 241, 242, 243, 244, 245
DISTRACTORS = {
    CHAIR_WITH_JACKET: "chair_with_jacket",
    MANNEQUIN: "mannequin",
    IMAGE_OF_PERSON: "image_of_person",
    COATS: "coats",
    PRAM: "pram",
}
