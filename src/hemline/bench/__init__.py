"""Benchmarks of shipped models and the simulator for `hemline bench`, which any installation can run.

Experiments that compare with other engines, need data, or take hours are in `benchmarks/` of the repository.
"""
