"""The page on which a person teaches or operates in the browser: scene, grid, answers, receipt and console."""
