"""Learn to tell a label from the pictures of a data set that `tactile dataset` made.

    python docs/learn_from_pictures.py DIR/imagefolder LABEL

Trains on the pictures of train/ and counts the right ones of test/. Needs scikit-learn and Pillow.
"""

import csv
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from sklearn.decomposition import PCA
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

SIZE = (30, 40)  # of a picture that is learnt from, px


def load(folder: Path, label: str) -> tuple[np.ndarray, np.ndarray]:
    """Return pictures (n, k), their labels (n,), of the frames in contact that have one."""
    with open(folder / "metadata.csv", encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row[label] and row["place_x_m"]]
    pictures = [np.asarray(Image.open(folder / row["file_name"]).resize(SIZE)).ravel() for row in rows]
    return np.array(pictures, np.float32), np.array([row[label] for row in rows])


def main() -> None:
    """Train and test; prints the share of right answers beside that of the commonest label."""
    folder, label = Path(sys.argv[1]), sys.argv[2]
    (known, words), (unseen, truth) = (load(folder / split, label) for split in ("train", "test"))
    learner = make_pipeline(StandardScaler(), PCA(min(20, len(known) - 1), random_state=0), SVC())
    learner.fit(known, words)
    names, counts = np.unique(words, return_counts=True)
    common = names[counts.argmax()]
    right, always = np.mean(learner.predict(unseen) == truth), np.mean(truth == common)
    print(f"{len(known)} pictures learnt, {len(unseen)} told; right: {right:.2f}, always {str(common)!r}: {always:.2f}")


if __name__ == "__main__":
    main()
