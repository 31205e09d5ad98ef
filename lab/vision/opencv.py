"""OpenCV, which loads slowly: `cv2` of this module loads the library when an attribute is first used."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import cv2 as cv2
else:

    class _Later:
        """Stands for the library and forwards to its attributes."""

        def __getattr__(self, name: str) -> Any:
            import cv2

            return getattr(cv2, name)

    cv2 = _Later()
