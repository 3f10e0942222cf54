"""Experiments run from a checkout as `python -m benchmarks.NAME`: other engines, meshes of others, browsers, long runs.

Times of shipped models, which any installation can measure, are in `hemline.bench`; experiments of a paper in
`papers/`.
"""
