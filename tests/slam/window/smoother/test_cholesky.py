import numpy as np

from rislam_rt.slam.window.smoother.cholesky import form_and_log_det, inverse, solution


def test_one_factor_gives_inverse_solution_form_and_determinant() -> None:
    rng = np.random.default_rng(1)
    root, right = rng.normal(size=(6, 6)), rng.normal(size=6)
    matrix = root @ root.T + 0.1 * np.eye(6)
    form, log_det = form_and_log_det(matrix, right)
    np.testing.assert_allclose(form, right @ np.linalg.solve(matrix, right), rtol=1e-9)
    np.testing.assert_allclose(log_det, np.linalg.slogdet(matrix)[1], atol=1e-12)
    np.testing.assert_allclose(solution(matrix, right), np.linalg.solve(matrix, right), rtol=1e-9)
    np.testing.assert_allclose(inverse(matrix), np.linalg.inv(matrix), rtol=1e-8)
