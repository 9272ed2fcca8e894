-- Deletes all reports of a camera and its image, in one atomic step. Returns 1 if it had reports.
-- It follows forget.lua.
local found = forget_camera(camera)
if freed > 0 then
  redis.call('HINCRBY', totals, 'bytes', -freed)
end
return found
