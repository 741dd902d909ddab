"""The linear algebra of small matrices does not spread over cores that are busy with runs."""

from threadpoolctl import ThreadpoolController, threadpool_limits

from calibrator.threads import on_one_thread


def blas_threads():
    return {pool["num_threads"] for pool in ThreadpoolController().select(user_api="blas").info()}


def test_linear_algebra_is_on_one_thread_inside_and_as_before_outside():
    with threadpool_limits(limits=2, user_api="blas"):
        assert blas_threads() == {2}
        assert on_one_thread(blas_threads)() == {1}
        assert blas_threads() == {2}
