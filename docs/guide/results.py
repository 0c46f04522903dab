"""didim's files in pandas and NumPy.

    didim identify --cell cell.toml --input motion.csv --out result.json
    python3 results.py result.json [history.jsonl]

prints the parameters with their uncertainty, the pairs that the motion tells apart worst, and how the
parameters of the service's history went over time. A result is what `didim identify --json` printed, or a
`result-*.json` of the service; its history is `history.jsonl` in the same folder.
"""

import json
import sys

import numpy as np
import pandas as pd


def read_estimate(file):
    """What was identified: the object itself, or its part of the record that the service stores."""
    with open(file, encoding="utf-8") as text:
        record = json.load(text)
    return record.get("estimate", record)


def parameters(estimate):
    """A row for each parameter: unit (results of the first version have none), value, standard deviation."""
    columns = ["unit", "value", "standard_deviation"]
    return pd.DataFrame(estimate["parameters"]).set_index("name").reindex(columns=columns)


def covariance(estimate):
    """The covariance of the parameters, named; its file has the rows of the lower triangle, one text each."""
    names = [parameter["name"] for parameter in estimate["parameters"]]
    lower = np.zeros((len(names), len(names)))
    for row, text in enumerate(estimate["covariance"]):
        lower[row, : row + 1] = np.array(text.split(), dtype=float)
    whole = lower + np.tril(lower, -1).T
    return pd.DataFrame(whole, index=names, columns=names)


def correlations(matrix):
    """Each pair of parameters once, the most correlated first."""
    sigma = np.sqrt(np.diag(matrix))
    correlation = matrix.to_numpy() / np.outer(sigma, sigma)
    first, second = np.triu_indices(len(matrix), 1)
    pairs = pd.DataFrame({
        "first": matrix.index[first],
        "second": matrix.index[second],
        "correlation": correlation[first, second],
    })
    return pairs.sort_values("correlation", key=np.abs, ascending=False, ignore_index=True)


def read_history(file):
    """A row for each parameter of each result: time, result, usable for monitoring or not, value, standard deviation."""
    lines = []
    with open(file, encoding="utf-8") as text:
        # A line is whole when it ends: a power cut may have left half of the last one.
        for line in text:
            if not line.endswith("\n"):
                break
            lines.append(json.loads(line))
            # Results of earlier versions have one verdict for all uses.
            lines[-1]["good"] = lines[-1].get("monitoring", lines[-1].get("applicable"))
    rows = pd.json_normalize(lines, "parameters", ["time", "result", "good"])
    rows["time"] = pd.to_datetime(rows["time"])
    return rows


def main():
    estimate = read_estimate(sys.argv[1])
    print(parameters(estimate).to_string())
    if "covariance" in estimate:
        print("\n" + correlations(covariance(estimate)).head(5).to_string())
    for file in sys.argv[2:]:
        history = read_history(file)
        good = history[history["good"].astype(bool)]
        print("\n" + good.pivot_table(index="time", columns="name", values="value").to_string())


if __name__ == "__main__":
    main()
