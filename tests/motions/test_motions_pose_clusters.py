"""Poses sorted into clusters."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline.errors import BadInput
from hemline.motions.pose_clusters import cluster_poses, farthest_poses, square_distances, without_heading
from hemline.motions.quaternions import from_axis_angle, multiply

ONES = np.ones(24)


def scattered(seed: int = 0, count: int = 40, around=((0.0, 0.9), (0.7, -0.8), (-1.0, 0.1))) -> np.ndarray:
    """Poses in three heaps: elbows 18 and 19 at given angles, everything else nearly at rest (3 count, 24, 4)."""
    random = np.random.default_rng(seed)
    heaps = []
    for left, right in around:
        turns = 0.05 * random.normal(size=(count, 24, 3))
        turns[:, 18, 0] += left
        turns[:, 19, 0] += right
        heaps.append(from_axis_angle(turns))
    return np.concatenate(heaps)


def test_heaps_are_found_and_stood_for_by_a_pose_in_their_middle():
    poses = scattered()
    found = cluster_poses(poses, ONES, 3, seed=1)
    assert sorted(sorted(np.unique(members // 40)) for members in found.members) == [[0], [1], [2]]
    assert [len(members) for members in found.members] == [40, 40, 40]
    assert found.residual < 0.2
    away = square_distances(without_heading(poses), found.means, ONES)
    for cluster, members in enumerate(found.members):
        assert (np.diff(away[members, cluster]) >= 0).all()
        # the mean is where rotation vectors to all of them cancel out
        way = Rotation.from_quat(found.means[cluster][:, [1, 2, 3, 0]])
        vectors = [
            (way.inv() * Rotation.from_quat(p[:, [1, 2, 3, 0]])).as_rotvec() for p in without_heading(poses[members])
        ]
        assert np.abs(np.mean(vectors, axis=0)).max() < 1e-6


def test_more_clusters_leave_less_and_the_seed_decides():
    poses = scattered()
    shares = [cluster_poses(poses, ONES, count).residual for count in (1, 3, 10, 120)]
    assert shares[0] == pytest.approx(1) and (np.diff(shares) < 0).all() and shares[3] < 1e-9
    one, two = cluster_poses(poses, ONES, 10, seed=4), cluster_poses(poses, ONES, 10, seed=4)
    np.testing.assert_array_equal(one.means, two.means)


def test_joints_without_weight_do_not_count():
    """Heaps that differ in the right elbow alone are one where it has no weight."""
    poses = scattered(around=((0.0, 0.9), (0.0, -0.9)))
    weights = ONES.copy()
    weights[19] = 0
    both, left = cluster_poses(poses, ONES, 2), cluster_poses(poses, weights, 2)
    assert both.residual < 0.3 < 0.7 < left.residual


def test_where_bodies_head_is_left_out_and_how_they_tilt_is_kept():
    random = np.random.default_rng(3)
    tilt = from_axis_angle(np.array([0.4, 0.0, -0.2]))
    headings = from_axis_angle(random.uniform(-3, 3, size=(20, 1)) * [0.0, 1.0, 0.0])
    poses = np.tile([1.0, 0.0, 0.0, 0.0], (20, 24, 1))
    poses[:, 0] = multiply(headings, tilt)
    same = without_heading(poses)
    assert square_distances(same, same, ONES).max() < 1e-12
    up = Rotation.from_quat(same[:, 0][:, [1, 2, 3, 0]]).inv().apply([0, 1, 0])
    np.testing.assert_allclose(
        up, np.tile(Rotation.from_rotvec([0.4, 0, -0.2]).inv().apply([0, 1, 0]), (20, 1)), atol=1e-9
    )


def test_distances_are_sums_of_angles():
    poses = scattered()[:5]
    weights = np.random.default_rng(0).uniform(size=24)
    one, other = (Rotation.from_quat(poses[k][:, [1, 2, 3, 0]]) for k in (0, 3))
    wanted = weights @ (one.inv() * other).magnitude() ** 2
    assert square_distances(poses, poses, weights)[0, 3] == pytest.approx(wanted)


def test_what_cannot_be_clustered_is_refused():
    poses = scattered()
    for count in (0, 121):
        with pytest.raises(BadInput, match="at most as many as poses that differ"):
            cluster_poses(poses, ONES, count)
    with pytest.raises(BadInput, match="at most as many as poses that differ; got 2"):
        cluster_poses(np.repeat(poses[:1], 5, axis=0), ONES, 2)
    for weights in (0 * ONES, -ONES, np.nan * ONES):
        with pytest.raises(BadInput, match="weights of joints are not negative"):
            cluster_poses(poses, weights, 2)


def test_far_poses_are_the_rare_ones_and_leave_none_farther_than_the_last_step():
    """Three heaps and five poses far from them: the five come first, then only poses nearer than each of them."""
    poses = scattered()
    rare = np.tile(poses[:1], (5, 1, 1))
    for pose, joint in zip(rare, (1, 2, 4, 5, 16), strict=True):
        pose[joint] = from_axis_angle(np.array([-2.0, 0.0, 0.0]))
    poses = np.concatenate([poses, rare])
    known = poses[[0, 40, 80]]
    chosen = farthest_poses(poses, known, ONES, 12)
    assert set(chosen[:5]) == set(range(120, 125)) and len(set(chosen)) == 12
    steps = []
    for number in range(12):
        others = without_heading(np.concatenate([known, poses[chosen[:number]]]))
        turns = [
            [(2 * np.arccos(np.minimum(np.abs((p * o).sum(axis=1)), 1)) ** 2).sum() for o in others]
            for p in without_heading(poses)
        ]
        away = np.min(2 * np.asarray(turns), axis=1)
        steps.append(away.max())
        assert away[chosen[number]] == pytest.approx(away.max(), rel=1e-6)
    assert (np.diff(steps) <= 1e-9).all()


def test_no_far_pose_is_a_known_one():
    poses = np.repeat(scattered(count=1), 3, axis=0)
    turned = multiply(from_axis_angle(np.array([0.0, 1.0, 0.0])), poses[:, 0])
    same = np.concatenate([turned[:, None], poses[:, 1:]], axis=1)
    assert len(farthest_poses(same, poses[:3], ONES, 9)) == 2
    assert len(farthest_poses(same, poses, ONES, 9)) == 0
