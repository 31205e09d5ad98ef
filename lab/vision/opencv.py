"""OpenCV, which takes a while to load: `cv2` here is loaded when one of its names is touched."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import cv2 as cv2
else:

    class _Later:
        """Has the names of the library."""

        def __getattr__(self, name: str) -> Any:
            import cv2

            return getattr(cv2, name)

    cv2 = _Later()
